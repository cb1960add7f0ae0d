//! A row a point, for spreadsheets and scripts.

use super::assemble::FRONTS;
use super::model::{Against, Interval, Metric, Report};

/// The report's points as CSV (RFC 4180), with a line of names.
///
/// # Errors
/// None that memory does not have.
pub fn csv(report: &Report) -> Result<Vec<u8>, csv::Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(header())?;
    for scene in &report.scenes {
        for (index, point) in scene.points.iter().enumerate() {
            let mut row = vec![scene.name.clone(), scene.size[0].to_string(), scene.size[1].to_string()];
            row.extend([scene.moving.to_string(), point.name.clone()]);
            row.extend(interval(Some(&point.time.wall)));
            row.extend(interval(point.time.gpu.as_ref()));
            row.extend(interval(point.time.cpu.as_ref()));
            row.push(point.time.confirmed.to_string());
            row.push(point.memory.to_string());
            row.push(point.gbuffer_bytes_per_pixel.to_string());
            for errors in [&point.errors.point, &point.errors.converged] {
                let psnr = errors.psnr_db.map_or_else(String::new, |psnr| psnr.to_string());
                row.extend([errors.rel_mse, errors.rmse, errors.max, errors.p99_9, errors.flip].map(|e| e.to_string()));
                row.extend([psnr, errors.not_finite.to_string()]);
            }
            for (metric, truth) in FRONTS {
                let front = scene.fronts.iter().find(|front| (front.metric, front.truth) == (metric, truth));
                row.push(front.map_or_else(String::new, |front| front.points.contains(&index).to_string()));
                let probability = front.and_then(|front| front.probability.get(index));
                row.push(probability.map_or_else(String::new, f64::to_string));
            }
            writer.write_record(row)?;
        }
    }
    writer.into_inner().map_err(|error| error.into_error().into())
}

fn header() -> Vec<String> {
    let mut names: Vec<String> = ["scene", "width", "height", "moving", "point"].map(str::to_owned).to_vec();
    for clock in ["wall", "gpu", "cpu"] {
        names.extend(["ms", "ms_low", "ms_high", "rounds"].map(|part| format!("{clock}_{part}")));
    }
    names.extend(["confirmed", "memory_bytes", "gbuffer_bytes_per_pixel"].map(str::to_owned));
    for truth in ["point", "converged"] {
        let figures = ["rel_mse", "rmse", "max", "p99_9", "flip", "psnr_db", "not_finite"];
        names.extend(figures.map(|figure| format!("{truth}_{figure}")));
    }
    for (metric, truth) in FRONTS {
        let (metric, truth) = (word(metric), if truth == Against::Point { "point" } else { "converged" });
        names.extend([format!("front_{metric}_{truth}"), format!("front_{metric}_{truth}_probability")]);
    }
    names
}

fn word(metric: Metric) -> &'static str {
    match metric {
        Metric::RelMse => "rel_mse",
        Metric::Rmse => "rmse",
        Metric::Flip => "flip",
    }
}

fn interval(interval: Option<&Interval>) -> [String; 4] {
    interval.map_or_else(Default::default, |interval| {
        [interval.median.to_string(), interval.low.to_string(), interval.high.to_string(), interval.count.to_string()]
    })
}

#[cfg(test)]
mod tests {
    use super::super::run::samples::report;
    use super::*;

    #[test]
    fn every_row_has_a_cell_for_each_name() {
        let report = report();
        let text = csv(&report).expect("written");
        let mut reader = csv::Reader::from_reader(text.as_slice());
        let rows: Vec<csv::StringRecord> = reader.records().collect::<Result<_, _>>().expect("all of one length");
        assert_eq!(rows.len(), report.scenes.iter().map(|scene| scene.points.len()).sum::<usize>());
        assert_eq!((&rows[0][3], &rows[0][4]), ("true", "default"));
    }

    #[test]
    fn fronts_that_were_not_sought_have_empty_cells() {
        let mut report = report();
        report.scenes[0].fronts.retain(|front| front.truth == Against::Converged);
        let text = csv(&report).expect("written");
        let mut reader = csv::Reader::from_reader(text.as_slice());
        let names = reader.headers().expect("a line of names").clone();
        let row = reader.records().next().expect("a row").expect("of the same length");
        for (name, cell) in names.iter().zip(&row).filter(|(name, _)| name.starts_with("front_")) {
            assert_eq!(cell.is_empty(), !name.contains("converged"), "{name}: {cell}");
        }
    }
}
