//! The pixels that are taken apart.

/// Pixels spread evenly over a picture, by index row by row: one out of each square of as many pixels as keeps their number at about
/// `most`; all of them in a picture of no more than that. Always the same for the same size.
pub fn spread(size: [u32; 2], most: usize) -> Vec<usize> {
    let [width, height] = size.map(|edge| edge as usize);
    let edge = ((width * height) as f64 / most.max(1) as f64).sqrt().ceil().max(1.0) as usize;
    let mut random = fastrand::Rng::with_seed(1);
    let mut pixels = Vec::new();
    for top in (0..height).step_by(edge) {
        for left in (0..width).step_by(edge) {
            let [x, y] = [left, top].map(|corner| corner + random.usize(..edge));
            // Squares at the border count as far as they are in the picture: each pixel is as likely as any other.
            if x < width && y < height {
                pixels.push(y * width + x);
            }
        }
    }
    pixels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_picture_is_taken_whole() {
        assert_eq!(spread([5, 4], 20), (0..20).collect::<Vec<_>>());
        assert_eq!(spread([5, 4], 1000).len(), 20);
    }

    #[test]
    fn a_large_one_by_one_pixel_of_each_square() {
        let pixels = spread([1280, 720], 20_000);
        // Squares of 7 x 7.
        assert!((18_000..=20_000).contains(&pixels.len()), "{}", pixels.len());
        let mut quarters = [0; 4];
        for pixel in &pixels {
            let (x, y) = (pixel % 1280, pixel / 1280);
            quarters[(x / 640) + 2 * (y / 360)] += 1;
        }
        assert!(quarters.iter().all(|&count| (4500..=4900).contains(&count)), "{quarters:?}");
    }
}
