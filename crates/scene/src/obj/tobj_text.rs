//! The text that tobj reads.

use super::scan::FaceKey;

/// Appends a vertex's number where tobj looks for a colour.
pub(super) fn push_number(out: &mut String, vertex: usize) {
    out.push(' ');
    push_decimal(out, vertex);
    out.push_str(" 0 0");
}

/// Appends a face with the attributes of its part.
pub(super) fn write_face(out: &mut String, corners: &[[usize; 3]], part: &FaceKey) {
    let mut push = |separator: char, index: Option<usize>| {
        out.push(separator);
        if let Some(index) = index {
            push_decimal(out, index);
        }
    };
    for (number, &[position, uv, normal]) in corners.iter().enumerate() {
        if number == 0 {
            push('f', None);
        }
        push(' ', Some(position));
        if part.has_uvs || part.has_normals {
            push('/', part.has_uvs.then_some(uv));
        }
        if part.has_normals {
            push('/', Some(normal));
        }
    }
    out.push('\n');
}

/// Appends a number's digits; `write!` takes a third of the whole scan's time.
fn push_decimal(out: &mut String, mut number: usize) {
    let mut digits = [0_u8; 20];
    let mut first = digits.len();
    loop {
        first -= 1;
        digits[first] = b'0' + (number % 10) as u8;
        number /= 10;
        if number == 0 {
            break;
        }
    }
    out.extend(digits[first..].iter().map(|&digit| char::from(digit)));
}
