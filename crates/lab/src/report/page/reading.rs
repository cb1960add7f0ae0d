//! The section on reading the page, and on the origin of its figures.

use maud::{Markup, html};

pub fn section() -> Markup {
    html! {
        section.reading id="reading" {
            h2 { "How to read this" }
            h3 { "What error is" }
            p {
                "Every picture is compared with one that a 64-bit renderer on the CPU computes from the same scene by casting rays. It has no \
                 G-buffer, no shadow maps and none of the shaders' code. There are two truths. " strong { "Point" }
                " truth looks where the rasterizer looks, at pixel centres, with textures bilinear at their finest level: what remains is                  numeric error, and how textures are filtered. "
                strong { "Converged" } " truth averages many samples over each pixel, so that jagged edges count too, and mipmaps are                  compared with the mean that they stand for."
            }
            (metrics())
            h3 id="flip" { "What an error looks like" }
            p {
                "A mean FLIP of 0.01 nobody sees. At 0.05 pictures look the same side by side; flipped between, textures far away and edges are a \
                 little softer or rougher. At 0.1 materials or some shadows look different, if one knows where to look. At 0.3 it is another picture: a light or all \
                 shadows are missing. " code { "docs/FLIP.md" } " of the program shows pictures, with the commands that draw and compare them."
            }
            h3 { "How time was measured" }
            p {
                "All settings take turns: blocks of pictures are drawn in a random order, over and over, so that a machine that gets warm or \
                 busy slows all of them alike. Each begins with pictures that are not counted, until windows of them agree, since an idle GPU has low clocks. The figure is the \
                 median, its 95% interval comes from resampling the measurements (bootstrap). On a device with a clock of its own that clock \
                 counts; where a CPU draws, the wall clock does, from the start of recording until the picture is done."
            }
            p {
                "A point is on the front if no other is both faster and closer to the truth. Chance can put a lucky run there: so points that \
                 were found on a front were measured again, and the second figures are those shown. The probability of being on it comes from \
                 the same resampling. A time known to worse than 5% is drawn hollow."
            }
            h3 { "What the marks mean" }
            p {
                "Both axes are logarithmic. An error of exactly 0 has no place there: it is drawn on the dotted line at the bottom, with an arrow. \
                 Below the dashed line the truth's own noise is larger than the error. A pointer over a mark says what it is; the tables under \
                 the plots have the same numbers."
            }
        }
    }
}

fn metrics() -> Markup {
    let metrics = [
        (
            "relMSE",
            "Mean of squared error over squared truth plus 0.01, in linear light where 1 saturates the sensor. Well above a tenth, error \
             counts in proportion to the light; well below, whatever the light, so that what is dark anyway counts little. A few pixels \
             that should be dark and are bright can rule it.",
        ),
        ("RMSE", "Root of the mean squared error, in linear light where 1 saturates the sensor. Bright parts rule it."),
        (
            "p99.9",
            "The error that one pixel value in a thousand exceeds. It tells small wrong spots, which means hide.",
        ),
        (
            "FLIP",
            "What an eye notices when it flips between the two tone-mapped pictures, as a mean over the pixels from 0, alike, to \
             1 (Andersson and others, 2020).",
        ),
        (
            "PSNR",
            "Squared error of the tone-mapped pictures in decibels: 20 more is a tenth of the error. 8-bit rounding alone leaves about 59.",
        ),
        (
            "Share, mean, RMS",
            "Of a part of the error: its part of the squared error; its signed average, negative where the picture is too dark; and its size \
             regardless of sign.",
        ),
    ];
    html! { dl { @for (name, what) in metrics { div { dt { (name) } dd { (what) } } } } }
}
