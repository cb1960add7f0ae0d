//! Baselines: pictures and times of earlier runs on the same driver and device, and the cases that are known to fail. Each device has a folder,
//! `DIR/DRIVER/DEVICE`. The folder of a device that is a CPU names its vendor and the width of its vectors too, since pictures of a software driver
//! may differ between CPUs.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use afterlight_files::regular_file::read_regular;
use afterlight_truth::measure::Srgb8Image;
use serde::{Deserialize, Serialize};

use super::results;
use super::verdict::{CaseReport, Status, Verdict};
use crate::compare::ImageFile;
use crate::failure::{Exit, Failure};
use crate::output::{self, Sink};

/// The cases that are known to fail, as `failures.csv` has them.
pub const FAILURES: &str = "failures.csv";
/// The device's time for a frame, in milliseconds.
const TIMES: &str = "times.csv";
/// The folder of a bundle with the picture and the time that its case was compared with.
const BUNDLED: &str = "baseline";

/// A device as baselines know it: its driver's name and its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DeviceKey {
    pub driver: String,
    pub device: String,
    /// The CPU that draws, as [`cpu_kind`](afterlight_truth::measure::cpu_kind) names it; `None` for other devices.
    pub cpu: Option<String>,
}

impl DeviceKey {
    /// The name of its folder.
    fn folder(&self) -> String {
        let cpu = self.cpu.as_ref().map(|cpu| format!(" {cpu}")).unwrap_or_default();
        key(&format!("{}{cpu}", self.device))
    }
}

/// A device's folder.
#[derive(Debug, Clone, PartialEq)]
pub struct Baseline {
    folder: PathBuf,
    times: BTreeMap<String, f64>,
    /// Why nothing of this device is there.
    missing: Option<String>,
}

impl Baseline {
    /// Reads the baseline of the device. A missing folder is an empty baseline.
    ///
    /// # Errors
    /// When its times cannot be read.
    pub fn open(all: &Path, own: &DeviceKey) -> Result<Self, Failure> {
        let folder = all.join(key(&own.driver)).join(own.folder());
        let missing = (!folder.exists()).then(|| missing(&folder, own));
        Self::read(folder, missing)
    }

    /// Returns the baseline that a bundle holds for its case, whichever device tries it again; `None` where it was compared with none.
    ///
    /// # Errors
    /// As [`Baseline::open`].
    pub fn of_bundle(bundle: &Path) -> Result<Option<Self>, Failure> {
        let folder = bundle.join(BUNDLED);
        folder.is_dir().then(|| Self::read(folder, None)).transpose()
    }

    /// Copies the case's picture and time into its bundle.
    ///
    /// # Errors
    /// When a file cannot be read or written.
    pub fn keep(&self, case: &str, bundle: &Path) -> Result<(), Failure> {
        let folder = bundle.join(BUNDLED);
        output::make_folder(&folder)?;
        let picture = self.folder.join(format!("{case}.png"));
        if picture.exists() {
            let bytes = read_regular(&picture, results::MOST_BYTES);
            let cannot = |error| Failure::new(Exit::BadInput, format!("cannot read {}: {error}", picture.display()));
            Sink::File(folder.join(format!("{case}.png"))).write(&bytes.map_err(cannot)?)?;
        }
        let time = self.gpu_ms(case).map_or_else(String::new, |ms| format!("{case},{ms}\n"));
        Sink::File(folder.join(TIMES)).write(time.as_bytes())
    }

    fn read(folder: PathBuf, missing: Option<String>) -> Result<Self, Failure> {
        let path = folder.join(TIMES);
        let mut times = BTreeMap::new();
        if path.exists() {
            for (line, text) in results::lines(&path)? {
                let parsed =
                    text.split_once(',').and_then(|(case, ms)| Some((case.to_owned(), ms.trim().parse().ok()?)));
                let (case, ms): (_, f64) =
                    parsed.ok_or_else(|| results::bad(&path, line, "expected CASE,MILLISECONDS"))?;
                times.insert(case, ms);
            }
        }
        Ok(Self { folder, times, missing })
    }

    /// Returns a sentence about a baseline that has nothing of this device, with what to do; `None` for one that has its folder.
    pub fn missing(&self) -> Option<&str> {
        self.missing.as_deref()
    }

    /// Returns the cases that are known to fail on the device; none where the file is not there.
    pub fn failures(&self) -> Result<BTreeMap<String, Status>, Failure> {
        let path = self.folder.join(FAILURES);
        if path.exists() { results::read(&path) } else { Ok(BTreeMap::new()) }
    }

    /// The files of regular expressions that are there for the device: `skips.txt` or `flakes.txt`.
    pub fn expressions(&self, name: &str) -> Option<PathBuf> {
        Some(self.folder.join(name)).filter(|path| path.exists())
    }

    /// The case's picture, if there is one; or why it cannot be read.
    pub fn picture(&self, case: &str) -> Result<Option<Srgb8Image>, String> {
        let path = self.folder.join(format!("{case}.png"));
        if !path.exists() {
            return Ok(None);
        }
        match ImageFile::open(&path) {
            Ok(ImageFile::Shown(picture)) => Ok(Some(picture)),
            Ok(ImageFile::Light(_)) => Err(format!("{} holds linear light, and a picture is needed", path.display())),
            Err(failure) => Err(failure.one_line()),
        }
    }

    pub fn gpu_ms(&self, case: &str) -> Option<f64> {
        self.times.get(case).copied()
    }

    /// Stores the results of a run that was not compared with a baseline: the failing cases; of passing cases the pictures from their folders and, if
    /// no other case used the device meanwhile, the times. Cases that did not run keep their entries.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn bless(mut self, reports: &[CaseReport], cases: &Path, is_shared: bool) -> Result<(), Failure> {
        output::make_folder(&self.folder)?;
        let mut failures = self.failures()?;
        for report in reports {
            let name = &report.case;
            if report.verdict == Verdict::Pass {
                if let Ok(bytes) = fs::read(cases.join(name).join("picture.png")) {
                    Sink::File(self.folder.join(format!("{name}.png"))).write(&bytes)?;
                }
                self.times.extend(report.gpu_ms.filter(|_| !is_shared).map(|ms| (name.clone(), ms)));
            }
            match report.verdict.status() {
                Status::Pass | Status::Skip | Status::Flake => _ = failures.remove(name),
                status => _ = failures.insert(name.clone(), status),
            }
        }
        let times: String = self.times.iter().map(|(case, ms)| format!("{case},{ms:.4}\n")).collect();
        Sink::File(self.folder.join(TIMES)).write(times.as_bytes())?;
        let failures: String = failures.iter().map(|(case, status)| format!("{case},{}\n", status.name())).collect();
        Sink::File(self.folder.join(FAILURES)).write(failures.as_bytes())
    }
}

/// Explains why a baseline has no `folder` for the device.
fn missing(folder: &Path, own: &DeviceKey) -> String {
    let shown = folder.display();
    let bless = "--bless makes one here";
    let Some((cpu, driver)) = own.cpu.as_ref().zip(folder.parent()) else {
        return format!("nothing is compared with the baseline, which has no {shown}: {bless}");
    };
    let differ = "pictures of a software driver may differ between CPUs";
    let unnamed = key(&own.device);
    if driver.join(&unnamed).exists() {
        return format!(
            "nothing is compared with the baseline {}: it is of an older program, which did not name the CPU, and {differ}. If it was made on a CPU \
             as this one ({cpu}), rename the folder to {shown}; otherwise {bless}",
            driver.join(&unnamed).display()
        );
    }
    let names = fs::read_dir(driver).into_iter().flatten().flatten().map(|entry| entry.file_name());
    let names = names.filter_map(|name| name.into_string().ok());
    let mut others: Vec<String> = names.filter(|name| name.starts_with(&format!("{unnamed}-"))).collect();
    others.sort();
    match others.as_slice() {
        [] => format!("nothing is compared with the baseline, which has no {shown}: {bless}"),
        others => format!(
            "nothing is compared with the baseline, which has this driver on other CPUs ({}) and no {shown}: {differ}, and this one is {cpu}; {bless}",
            others.join(", ")
        ),
    }
}

/// A name as a folder has it: letters and digits, and one dash for all between them.
fn key(name: &str) -> String {
    let words = name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    let key = words.collect::<Vec<_>>().join("-").to_lowercase();
    if key.is_empty() { "unknown".to_owned() } else { key }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_software_drivers_folder_names_the_cpu_and_another_says_why_it_does_not_match() {
        let all = tempfile::tempdir().expect("a temporary folder");
        let of = |cpu: Option<&str>| DeviceKey {
            driver: "llvmpipe".into(),
            device: "llvmpipe (LLVM 15.0.6, 256 bits)".into(),
            cpu: cpu.map(str::to_owned),
        };
        let (intel, amd) = (of(Some("Intel, 512-bit vectors")), of(Some("AMD, 256-bit vectors")));
        let open = |own: &DeviceKey| Baseline::open(all.path(), own).expect("nothing is unreadable");
        let missing = |own: &DeviceKey| open(own).missing().unwrap_or_default().to_owned();
        let driver = all.path().join("llvmpipe");
        assert!(
            missing(&intel).contains("which has no ") && missing(&intel).contains("--bless"),
            "{}",
            missing(&intel)
        );

        // One of an older program.
        fs::create_dir_all(driver.join("llvmpipe-llvm-15-0-6-256-bits")).expect("made");
        let told = missing(&intel);
        assert!(told.contains("did not name the CPU") && told.contains("Intel, 512-bit vectors"), "{told}");
        let renamed = "rename the folder to ".to_owned()
            + &driver.join("llvmpipe-llvm-15-0-6-256-bits-intel-512-bit-vectors").display().to_string();
        assert!(told.contains(&renamed), "{told}");
        // A GPU of that name keeps its folder.
        assert_eq!(open(&of(None)).missing(), None);
        fs::rename(
            driver.join("llvmpipe-llvm-15-0-6-256-bits"),
            driver.join("llvmpipe-llvm-15-0-6-256-bits-intel-512-bit-vectors"),
        )
        .expect("renamed");
        assert_eq!(open(&intel).missing(), None);
        let told = missing(&amd);
        assert!(told.contains("on other CPUs (llvmpipe-llvm-15-0-6-256-bits-intel-512-bit-vectors)"), "{told}");
        assert!(told.contains("this one is AMD, 256-bit vectors"), "{told}");
    }

    #[test]
    fn a_bundle_holds_what_its_case_was_compared_with() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        fs::create_dir_all(at("all/lavapipe/cpu")).expect("made");
        fs::write(at("all/lavapipe/cpu/times.csv"), "a.b,1.25\na.c,3\n").expect("written");
        let picture = image::RgbImage::from_pixel(2, 1, image::Rgb([9, 8, 7]));
        picture.save(at("all/lavapipe/cpu/a.b.png")).expect("written");
        let own = DeviceKey { driver: "lavapipe".into(), device: "cpu".into(), cpu: None };
        let known = Baseline::open(&at("all"), &own).expect("read");
        for (case, has_picture, ms) in [("a.b", true, Some(1.25)), ("a.c", false, Some(3.0)), ("a.d", false, None)] {
            let bundle = at(case);
            fs::create_dir(&bundle).expect("made");
            assert_eq!(Baseline::of_bundle(&bundle).expect("none"), None);
            known.keep(case, &bundle).expect("written");
            let kept = Baseline::of_bundle(&bundle).expect("read").expect("there");
            assert_eq!((kept.picture(case).expect("read").is_some(), kept.gpu_ms(case)), (has_picture, ms), "{case}");
        }
    }

    #[test]
    fn folders_are_named_after_drivers_and_devices() {
        let names = ["llvmpipe (LLVM 15.0.6, 256 bits)", "NVIDIA H200", "../..", ""];
        assert_eq!(names.map(key), ["llvmpipe-llvm-15-0-6-256-bits", "nvidia-h200", "unknown", "unknown"]);
    }
}
