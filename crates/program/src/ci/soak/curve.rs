//! Judges the samples of a soak or of a storm of resizes: the median of a quarter of the samples near the start is compared with the last quarter's,
//! so that single samples say nothing. Objects and their memory, which this program counts itself, may not exceed the first sample either.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use afterlight::gpu::{self, Device};
use afterlight_truth::measure::{Distribution, open_files, resident_memory_bytes, threads};

use super::super::evidence::EvidenceFolder;
use super::super::verdict::{CaseReport, CheckKind, CheckOutcome};

/// Laps of a soak: the first warms up.
pub const LAPS: u32 = 4;
/// Samples that a curve needs.
pub const LEAST_SAMPLES: usize = 8;

/// The file of the objects that were more at one sample than at the one before, by frame.
const OBJECTS: &str = "soak-objects.txt";
const MIB: f64 = 1_048_576.0;

/// A sample, measured at home. A value is `None` where the system does not tell it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoakSample {
    /// Frames or sizes drawn until then.
    pub frame: u32,
    /// Resident memory of the process, in bytes.
    pub resident: Option<u64>,
    /// Memory of the device's objects, in bytes.
    pub device_bytes: u64,
    /// Memory of the blocks that they lie in, in bytes.
    pub block_bytes: u64,
    /// Vulkan objects that are alive.
    pub objects: usize,
    pub open_files: Option<usize>,
    pub threads: Option<usize>,
    /// Microseconds from the start of recording until the device is done.
    pub frame_us: f64,
}

impl SoakSample {
    /// Measures memory, objects, files and threads of the process and the device. Idling also drops cached pipelines and destroys retired objects.
    pub fn take(frame: u32, frame_us: f64, device: &Device) -> gpu::Result<Self> {
        device.wait_idle()?;
        let memory = device.memory_report();
        Ok(Self {
            frame,
            resident: resident_memory_bytes(),
            device_bytes: memory.bytes,
            block_bytes: memory.block_bytes,
            objects: memory.objects.values().sum(),
            open_files: open_files(),
            threads: threads(),
            frame_us,
        })
    }
}

/// The measured values that may not grow.
struct GrowthBound {
    what: &'static str,
    check: CheckKind,
    of: fn(&SoakSample) -> Option<f64>,
    /// Growth that counts as none, by itself and as a share of the first median: the greater of both.
    slack: f64,
    share: f64,
    /// The first sample bounds it as well: a cache that keeps an entry for each setting is full after the first lap.
    from_first: bool,
    text: fn(f64) -> String,
}

/// The system's allocator and a driver's compiler keep memory that they have taken, so they get some slack. This program counts objects and their
/// memory itself: only buffers that have grown with their contents get slack.
const BOUNDS: [GrowthBound; 7] = [
    GrowthBound {
        what: "resident memory",
        check: CheckKind::Memory,
        of: |own| own.resident.map(|bytes| bytes as f64),
        slack: 8.0 * MIB,
        share: 1.0 / 32.0,
        from_first: false,
        text: mebibytes,
    },
    GrowthBound {
        what: "memory of objects on the device",
        check: CheckKind::Memory,
        of: |own| Some(own.device_bytes as f64),
        slack: MIB,
        share: 0.0,
        from_first: true,
        text: mebibytes,
    },
    GrowthBound {
        what: "memory of blocks on the device",
        check: CheckKind::Memory,
        of: |own| Some(own.block_bytes as f64),
        slack: 32.0 * MIB,
        share: 0.0,
        from_first: false,
        text: mebibytes,
    },
    GrowthBound {
        what: "objects on the device",
        check: CheckKind::ResourcesLeft,
        of: |own| Some(own.objects as f64),
        slack: 0.0,
        share: 0.0,
        from_first: true,
        text: count,
    },
    GrowthBound {
        what: "open files",
        check: CheckKind::ResourcesLeft,
        of: |own| own.open_files.map(|count| count as f64),
        slack: 0.0,
        share: 0.0,
        from_first: false,
        text: count,
    },
    GrowthBound {
        what: "threads",
        check: CheckKind::ResourcesLeft,
        of: |own| own.threads.map(|count| count as f64),
        slack: 0.0,
        share: 0.0,
        from_first: false,
        text: count,
    },
    GrowthBound {
        what: "time of a frame",
        check: CheckKind::Time,
        of: |own| Some(own.frame_us),
        slack: 100.0,
        share: 0.5,
        from_first: false,
        text: |us| format!("{us:.0} us"),
    },
];

fn mebibytes(bytes: f64) -> String {
    format!("{:.1} MiB", bytes / MIB)
}

fn count(number: f64) -> String {
    number.to_string()
}

/// One of the [`BOUNDS`], judged.
pub struct BoundResult {
    pub check: CheckKind,
    pub outcome: CheckOutcome,
    pub detail: String,
}

/// Judges all of a curve, and skips values that the system does not tell. The first lap warms up; fewer samples than [`LEAST_SAMPLES`] are not
/// judged.
pub fn judge(samples: &[SoakSample]) -> Vec<BoundResult> {
    let skipped = |bound: &GrowthBound, why: &str| {
        let detail = format!("{}: {why}", bound.what);
        BoundResult { check: bound.check, outcome: CheckOutcome::Skipped, detail }
    };
    let Some(first) = samples.first().filter(|_| samples.len() >= LEAST_SAMPLES) else {
        let why = format!("{} samples are too few, {LEAST_SAMPLES} are needed", samples.len());
        return BOUNDS.iter().map(|bound| skipped(bound, &why)).collect();
    };
    let warm = &samples[samples.len().div_ceil(LAPS as usize)..];
    let quarter = warm.len().div_ceil(4);
    let median = |part: &[SoakSample], of: fn(&SoakSample) -> Option<f64>| {
        let values = part.iter().map(of).collect::<Option<Vec<f64>>>()?;
        Distribution::of(values).map(|values| values.median)
    };
    let of = |bound: &GrowthBound| {
        let warmed = median(&warm[..quarter], bound.of)?;
        let end = median(&warm[warm.len() - quarter..], bound.of)?;
        let start = if bound.from_first { warmed.min((bound.of)(first)?) } else { warmed };
        let most = start + bound.slack.max(start * bound.share);
        let [started, ended, bounded] = [start, end, most].map(bound.text);
        let detail = format!("{} went from {started} to {ended}, at most {bounded}", bound.what);
        let outcome = if end <= most { CheckOutcome::Held } else { CheckOutcome::Failed };
        Some(BoundResult { check: bound.check, outcome, detail })
    };
    BOUNDS.iter().map(|bound| of(bound).unwrap_or_else(|| skipped(bound, "the system does not tell it"))).collect()
}

/// Notes how a curve is judged. Times are skipped where other cases share the device.
pub fn report_on(samples: &[SoakSample], is_shared: bool, report: &mut CaseReport) {
    for BoundResult { check, outcome, detail } in judge(samples) {
        if check == CheckKind::Time && is_shared {
            report.skip(check, "other cases use the device meanwhile: --jobs 1 gives times that mean something");
        } else {
            report.note(check, outcome, detail);
        }
    }
}

/// The objects that someone owns, counted by their names: the first clue to a leak.
#[derive(Default)]
pub struct ObjectCounts {
    counts: BTreeMap<String, usize>,
    /// The objects that were more than at the sample before, for all samples so far.
    told: String,
}

impl ObjectCounts {
    /// Counts them, and keeps which are more than at the sample before.
    pub fn look(&mut self, frame: u32, device: &Device, evidence: &EvidenceFolder) {
        let mut counts = BTreeMap::<String, usize>::new();
        device.live_objects().into_iter().for_each(|name| *counts.entry(name).or_default() += 1);
        let before = std::mem::replace(&mut self.counts, counts);
        if before.is_empty() {
            return;
        }
        let length = self.told.len();
        for (name, count) in &self.counts {
            let more = count.saturating_sub(before.get(name).copied().unwrap_or_default());
            if more > 0 {
                let _ = writeln!(self.told, "{frame}: {more} {name}");
            }
        }
        if self.told.len() > length {
            evidence.write(OBJECTS, self.told.as_bytes());
        }
    }
}

/// The curve as a table; values that the system does not tell are empty.
pub fn csv(samples: &[SoakSample]) -> String {
    let mut text = "frame,resident_bytes,device_bytes,block_bytes,objects,open_files,threads,frame_us\n".to_owned();
    let told = |number: Option<u64>| number.map_or_else(String::new, |number| number.to_string());
    for own in samples {
        let [files, threads] = [own.open_files, own.threads].map(|count| told(count.map(|count| count as u64)));
        let _ = writeln!(
            text,
            "{},{},{},{},{},{files},{threads},{:.1}",
            own.frame,
            told(own.resident),
            own.device_bytes,
            own.block_bytes,
            own.objects,
            own.frame_us
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As a soak of 100,000 frames is measured, with noise as a driver's and a system's: memory that breathes by 6 MiB, now and then a slow
    /// sample, a thread more, and objects in the middle of a change.
    fn curve() -> Vec<SoakSample> {
        let mut random = fastrand::Rng::with_seed(3);
        let sample = |index: u32| SoakSample {
            frame: index * 500,
            resident: Some((150 << 20) + random.u64(0..6 << 20) + if index < 40 { 0 } else { 30 << 20 }),
            device_bytes: 40 << 20,
            block_bytes: (64 << 20) + (16 << 20) * random.u64(0..2),
            objects: if random.u32(0..20) == 0 { 410 } else { 400 },
            open_files: Some(12 + usize::from(random.u32(0..10) == 0)),
            threads: Some(9 + usize::from(random.u32(0..10) == 0)),
            frame_us: 2000.0 + 300.0 * random.f64() + if random.u32(0..10) == 0 { 9000.0 } else { 0.0 },
        };
        (0..200).map(sample).collect()
    }

    /// The details that fail, where each sample of the noise is changed so.
    fn grown(change: impl Fn(&mut SoakSample, u32)) -> Vec<String> {
        let mut samples = curve();
        for (index, sample) in (0..).zip(&mut samples) {
            change(sample, index);
        }
        judge(&samples).into_iter().filter(|own| own.outcome == CheckOutcome::Failed).map(|own| own.detail).collect()
    }

    #[test]
    fn noise_is_no_growth() {
        assert!(judge(&curve()).iter().all(|own| own.outcome == CheckOutcome::Held));
        assert_eq!(grown(|_, _| ()), [""; 0]);
        // Less at the end is no growth, and a peak in between none either.
        assert_eq!(grown(|own, index| own.resident = Some((900 << 20) - u64::from(index) * 1000)), [""; 0]);
        assert_eq!(grown(|own, index| own.objects += if index == 100 { 1000 } else { 0 }), [""; 0]);
    }

    #[test]
    fn each_kind_of_growth_is_seen_and_told() {
        let leak = |what: &str, change: fn(&mut SoakSample, u32)| {
            let told = grown(change);
            assert!(told.len() == 1 && told[0].starts_with(what), "{what}: {told:?}");
        };
        leak("resident memory went from", |own, _| {
            own.resident = own.resident.map(|all| all + u64::from(own.frame) * 1000)
        });
        leak("memory of objects", |own, _| own.device_bytes += u64::from(own.frame) * 100);
        leak("memory of blocks", |own, _| own.block_bytes += u64::from(own.frame) * 1000);
        leak("objects on the device", |own, index| own.objects += index as usize / 100);
        leak("open files", |own, index| own.open_files = own.open_files.map(|all| all + index as usize / 100));
        leak("threads", |own, index| own.threads = own.threads.map(|all| all + index as usize / 100));
        leak("time of a frame", |own, _| own.frame_us *= 1.0 + f64::from(own.frame) / 50_000.0);
    }

    #[test]
    fn growth_of_the_first_lap_alone_is_seen_in_what_the_program_counts() {
        let told = grown(|own, index| own.objects += (index as usize).min(40));
        assert!(told.len() == 1 && told[0].starts_with("objects on the device went from 400 to 440"), "{told:?}");
        let told = grown(|own, index| own.device_bytes += u64::from(index.min(40)) << 16);
        assert!(told.len() == 1 && told[0].starts_with("memory of objects"), "{told:?}");
        // Drivers keep their compiled shaders: their memory may grow meanwhile.
        assert_eq!(grown(|own, index| own.block_bytes += u64::from(index.min(40)) << 24), [""; 0]);
    }

    #[test]
    fn what_the_system_does_not_tell_is_skipped_and_so_are_too_few_samples() {
        let mut samples = curve();
        for own in &mut samples {
            (own.resident, own.open_files, own.threads) = (None, None, None);
        }
        let of = |samples: &[SoakSample], outcome| judge(samples).iter().filter(|own| own.outcome == outcome).count();
        assert_eq!((of(&samples, CheckOutcome::Held), of(&samples, CheckOutcome::Skipped)), (4, 3));
        let mut samples = vec![curve()[0]; LEAST_SAMPLES];
        samples[6..].iter_mut().for_each(|own| own.objects = 1000);
        assert_eq!(of(&samples, CheckOutcome::Failed), 1, "8 samples are enough");
        assert_eq!(of(&samples[1..], CheckOutcome::Skipped), BOUNDS.len());
        assert_eq!(of(&[], CheckOutcome::Skipped), BOUNDS.len());
        let mut report = CaseReport::new("a.b");
        report_on(&samples[1..], false, &mut report);
        assert!(
            report.findings.iter().all(|own| own.outcome == CheckOutcome::Skipped && own.detail.contains("too few"))
        );
    }

    #[test]
    fn the_table_has_a_line_for_each_sample() {
        let own = SoakSample { frame: 8, resident: Some(5), open_files: None, frame_us: 1234.56, ..curve()[0] };
        let own = SoakSample { device_bytes: 1, block_bytes: 2, objects: 3, threads: Some(4), ..own };
        let text = csv(&[own, own]);
        let lines: Vec<_> = text.lines().collect();
        assert_eq!(lines.len(), 3);
        assert_eq!(lines[0].split(',').count(), lines[1].split(',').count());
        assert_eq!(lines[2], "8,5,1,2,3,,4,1234.6");
    }
}
