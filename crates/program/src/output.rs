//! Destinations of results: standard output, or a file that appears whole or not at all.

use std::fmt;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use afterlight_files::whole_file::WholeFile;
use serde::Serialize;

use super::failure::{Exit, Failure};

/// A place for a result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Sink {
    Stdout,
    File(PathBuf),
}

impl Sink {
    /// `-` is standard output, anything else a file's name.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text {
            "" => Err("a file name is needed, or - for standard output".into()),
            "-" => Ok(Self::Stdout),
            name => Ok(Self::File(name.into())),
        }
    }

    pub fn is_stdout(&self) -> bool {
        matches!(self, Self::Stdout)
    }

    /// Returns true if both are one file, under any names.
    pub fn is_same(&self, other: &Self) -> bool {
        let (Self::File(own), Self::File(other)) = (self, other) else { return false };
        let whole = |path: &Path| {
            fs::canonicalize(path).or_else(|_| {
                let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
                Ok::<_, io::Error>(fs::canonicalize(folder)?.join(path.file_name().unwrap_or_default()))
            })
        };
        own == other || whole(own).ok().is_some_and(|own| whole(other).is_ok_and(|other| own == other))
    }

    /// Finds out before the work whether its result can be written, as far as that can be known.
    pub fn check(&self) -> Result<(), Failure> {
        match self {
            Self::Stdout => Ok(()),
            // Gone again when the value is dropped.
            Self::File(path) => PendingFile::beside(path).map(|_| ()),
        }
    }

    /// Writes all of `bytes`. A file that is there already is replaced in one step, and kept when anything fails.
    pub fn write(&self, bytes: &[u8]) -> Result<(), Failure> {
        match self {
            Self::Stdout => write_stdout(bytes),
            Self::File(path) => PendingFile::beside(path)?.fill(bytes),
        }
    }
}

impl fmt::Display for Sink {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stdout => f.write_str("standard output"),
            Self::File(path) => path.display().fmt(f),
        }
    }
}

/// Writes to standard output and flushes it.
///
/// # Errors
/// When the write fails; a closed pipe ends the program quietly.
pub fn write_stdout(bytes: &[u8]) -> Result<(), Failure> {
    let mut stdout = io::stdout().lock();
    stdout.write_all(bytes).and_then(|()| stdout.flush()).map_err(|error| Failure::stdout(&error))
}

/// Writes for people: to standard output, or to standard error when a result has taken standard output.
///
/// # Errors
/// As [`write_stdout`]. Text that standard error does not take is lost, as no message about it could be printed.
pub fn print(text: &str, stdout_is_taken: bool) -> Result<(), Failure> {
    if stdout_is_taken {
        let _ = io::stderr().write_all(text.as_bytes());
        return Ok(());
    }
    write_stdout(text.as_bytes())
}

/// The value as indented JSON with a line end.
pub fn json(value: &impl Serialize) -> Result<String, Failure> {
    let text = serde_json::to_string_pretty(value);
    let failed = |error| Failure::new(Exit::BadInput, format!("cannot write the report as JSON: {error}"));
    text.map(|text| text + "\n").map_err(failed)
}

/// Keeps a command from writing over its own inputs.
pub fn spare<'a>(
    sinks: impl IntoIterator<Item = &'a Sink>,
    read: impl IntoIterator<Item = &'a PathBuf> + Clone,
) -> Result<(), Failure> {
    let overwrites = |sink: &Sink| read.clone().into_iter().any(|path| sink.is_same(&Sink::File(path.clone())));
    match sinks.into_iter().find(|sink| overwrites(sink)) {
        Some(sink) => Err(Failure::usage(format!("{sink} is read by this command, which would write over it"))),
        None => Ok(()),
    }
}

/// Makes a folder and its parents.
pub fn make_folder(path: &Path) -> Result<(), Failure> {
    match path.is_file() {
        true => Err(cannot_be(path, "it is a file, and a folder is needed")),
        false => fs::create_dir_all(path).map_err(|error| Failure::write(&path.display().to_string(), &error)),
    }
}

/// A file under a temporary name beside its target, so that the rename that publishes it stays on one file system.
struct PendingFile<'a> {
    /// As the user wrote it, for messages.
    name: &'a Path,
    /// Behind any symbolic links, which stay as they are.
    target: PathBuf,
    file: WholeFile,
}

impl<'a> PendingFile<'a> {
    fn beside(name: &'a Path) -> Result<Self, Failure> {
        let failed = |error: &io::Error| Failure::write(&name.display().to_string(), error);
        let target = match fs::metadata(name) {
            Ok(found) if found.is_dir() => return Err(cannot_be(name, "it is a directory")),
            Ok(found) if !found.is_file() => return Err(cannot_be(name, "it is not a regular file")),
            Ok(_) => fs::canonicalize(name).map_err(|error| failed(&error))?,
            Err(error) if error.kind() == io::ErrorKind::NotFound => name.to_owned(),
            Err(error) => return Err(failed(&error)),
        };
        if let Some(folder) = name.parent().filter(|folder| !folder.as_os_str().is_empty() && !folder.exists()) {
            return Err(cannot_be(name, &format!("there is no folder {}", folder.display())));
        }
        let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let file = WholeFile::begin_in(folder).map_err(|error| failed(&error))?;
        Ok(Self { name, target, file })
    }

    fn fill(mut self, bytes: &[u8]) -> Result<(), Failure> {
        let failed = |error: &io::Error| Failure::write(&self.name.display().to_string(), error);
        self.file.write_all(bytes).and_then(|()| self.file.sync()).map_err(|error| failed(&error))?;
        self.file.persist(&self.target).map_err(|error| failed(&error))
    }
}

fn cannot_be(name: &Path, why: &str) -> Failure {
    Failure::new(Exit::BadInput, format!("cannot write {}: {why}", name.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entries(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .expect("the folder is readable")
            .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_appears_whole_and_alone() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("out.png");
        let sink = Sink::File(path.clone());
        sink.check().expect("a new file can be written");
        assert!(entries(folder.path()).is_empty(), "checking leaves nothing behind");
        sink.write(b"first").expect("written");
        sink.write(b"second").expect("replaced");
        assert_eq!(fs::read(&path).expect("readable"), b"second");
        assert_eq!(entries(folder.path()), ["out.png"]);
    }

    #[test]
    fn one_file_is_the_same_by_whatever_name() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let sink = |name: &str| Sink::File(folder.path().join(name));
        for exists in [false, true] {
            assert!(sink("x.exr").is_same(&sink("x.exr")) && sink("x.exr").is_same(&sink("./x.exr")), "{exists}");
            assert!(!sink("x.exr").is_same(&sink("y.exr")) && !sink("x.exr").is_same(&sink("missing/x.exr")));
            fs::write(folder.path().join("x.exr"), b"x").expect("written");
        }
        assert!(!Sink::Stdout.is_same(&Sink::Stdout));
    }

    #[test]
    fn a_directory_or_a_missing_folder_is_refused_and_left_alone() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for name in ["", "missing/out.png"] {
            let sink = Sink::File(folder.path().join(name));
            assert!(sink.check().is_err() && sink.write(b"x").is_err(), "{sink}");
        }
        assert!(entries(folder.path()).is_empty());
    }

    #[test]
    #[cfg(unix)]
    fn a_link_is_followed_and_the_mode_is_that_of_any_new_file() {
        use std::os::unix::fs::{MetadataExt, symlink};
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (link, real) = (folder.path().join("link.png"), folder.path().join("real.png"));
        fs::write(&real, b"old").expect("written");
        symlink(&real, &link).expect("linked");
        Sink::File(link.clone()).write(b"new").expect("written through the link");
        assert_eq!(fs::read(&real).expect("readable"), b"new");
        assert!(fs::symlink_metadata(&link).expect("still there").file_type().is_symlink());

        let plain = folder.path().join("plain");
        fs::write(&plain, b"").expect("written");
        let mode = |path: &Path| fs::metadata(path).expect("there").mode();
        assert_eq!(mode(&real), mode(&plain));
    }
}
