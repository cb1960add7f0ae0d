//! Files that appear whole or not at all: written under a temporary name in the same folder, then renamed. A killed process leaves its temporary file
//! behind; the next process that writes into the folder removes it.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use tempfile::NamedTempFile;

const PREFIX: &str = ".afterlight-";
const SUFFIX: &str = ".part";

/// A file that is being written. Dropped before [`WholeFile::persist`], it is gone.
#[derive(Debug)]
pub struct WholeFile(NamedTempFile);

impl WholeFile {
    /// Begins one in the folder of its place, so that the rename stays on one file system. Removes files that killed processes have left there.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn begin_in(folder: &Path) -> io::Result<Self> {
        remove_left(folder);
        let mut builder = tempfile::Builder::new();
        builder.prefix(PREFIX).suffix(SUFFIX);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // Temporary files are private by default; these get the permissions that the umask leaves, as any new file does.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let file = builder.tempfile_in(folder).map_err(system_error)?;
        // The lock tells others that it is being written. Without locks on the file system it looks the same to them, and stays.
        let _ = file.as_file().try_lock();
        Ok(Self(file))
    }

    /// Waits until all of it is on the disk: some file systems tell of a full one only then.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn sync(&mut self) -> io::Result<()> {
        self.0.as_file().sync_all()
    }

    /// Puts the file into its place, over one that is there. A program that has that one open goes on reading it.
    ///
    /// # Errors
    /// When its place cannot be written; then the file that was there stays.
    pub fn persist(self, place: &Path) -> io::Result<()> {
        // `keep` also clears the attribute TEMPORARY on Windows. The file stays open, and locked, until it is in its place.
        let (_locked, path) = self.0.keep().map_err(|error| error.error)?;
        replace(&path, place).inspect_err(|_| _ = fs::remove_file(&path))
    }
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

/// Renames `file` to `place`. Unlike tempfile's rename, the standard library's also replaces, on Windows, a file that another program has open, if
/// that program lets others delete it (`FILE_SHARE_DELETE`). Scanners and indexers do not, but they close the file soon.
fn replace(file: &Path, place: &Path) -> io::Result<()> {
    const PATIENCE: Duration = Duration::from_secs(1);
    let begun = Instant::now();
    loop {
        match fs::rename(file, place) {
            Err(error) if is_held(&error) && begun.elapsed() < PATIENCE => thread::sleep(Duration::from_millis(20)),
            done => return done,
        }
    }
}

/// Returns true if another program may hold one of the files so that it cannot be renamed. Windows says "access denied" of a held place, too.
fn is_held(error: &io::Error) -> bool {
    const ACCESS_DENIED: i32 = 5;
    const SHARING_VIOLATION: i32 = 32;
    cfg!(windows) && matches!(error.raw_os_error(), Some(ACCESS_DENIED | SHARING_VIOLATION))
}

/// The system's own error: tempfile's adds the name of the temporary file, which means nothing to a user.
fn system_error(error: io::Error) -> io::Error {
    let text = error.to_string();
    match text.split_once(" at path ") {
        Some((system, _)) => io::Error::new(error.kind(), system.to_owned()),
        None => error,
    }
}

/// Removes unfinished files that no process holds a lock on. A file that cannot be removed does no harm.
fn remove_left(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.starts_with(PREFIX) && name.ends_with(SUFFIX) && is_left(&entry.path()) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Returns true if the process that wrote the file is gone, and its lock with it. A process that has just made the file may not have locked it yet.
fn is_left(path: &Path) -> bool {
    const JUST_NOW: std::time::Duration = std::time::Duration::from_secs(2);
    let is_old_file = || {
        let about = fs::symlink_metadata(path).ok()?;
        // Others do not come from this program, and to open a FIFO would block.
        Some(about.is_file() && about.modified().ok()?.elapsed().ok()? > JUST_NOW)
    };
    is_old_file() == Some(true) && File::open(path).is_ok_and(|file| file.try_lock().is_ok())
}

#[cfg(test)]
mod tests {
    use std::io::Read;
    use std::time::SystemTime;

    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("readable").map(|entry| entry.expect("an entry").file_name());
        let mut names: Vec<_> = entries.map(|name| name.to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    fn persist(folder: &Path, bytes: &[u8], place: &Path) -> io::Result<()> {
        let mut file = WholeFile::begin_in(folder).expect("it can be begun");
        file.write_all(bytes).expect("written");
        file.persist(place)
    }

    #[test]
    fn a_file_is_replaced_while_another_reads_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let place = folder.path().join("result");
        fs::write(&place, b"the old one, longer").expect("written");
        let mut reader = File::open(&place).expect("it opens");
        let mut old = [0; 4];
        reader.read_exact(&mut old).expect("readable");
        persist(folder.path(), b"the new one", &place).expect("replaced");
        assert_eq!(fs::read(&place).expect("readable"), b"the new one");
        let mut rest = Vec::new();
        reader.read_to_end(&mut rest).expect("readable");
        assert_eq!([&old[..], &rest].concat(), b"the old one, longer");
        assert_eq!(names(folder.path()), ["result"]);
    }

    #[test]
    fn a_file_that_cannot_be_put_into_its_place_leaves_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        let place = folder.path().join("a folder");
        fs::create_dir(&place).expect("a folder");
        fs::write(place.join("inside"), b"kept").expect("written");
        let error = persist(folder.path(), b"no room", &place).expect_err("a folder is no place for a file");
        assert!(!error.to_string().contains(PREFIX), "{error}");
        assert_eq!((names(folder.path()), names(&place)), (vec!["a folder".to_owned()], vec!["inside".to_owned()]));
    }

    /// The file has the permissions that the umask leaves, and no attribute of a temporary file.
    #[test]
    fn a_file_in_its_place_is_as_any_new_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let [place, plain] = ["result", "plain"].map(|name| folder.path().join(name));
        persist(folder.path(), b"whole", &place).expect("put into place");
        fs::write(&plain, b"plain").expect("written");
        let [own, usual] = [&place, &plain].map(|path| fs::metadata(path).expect("it is there"));
        assert_eq!(own.permissions(), usual.permissions());
        #[cfg(windows)]
        {
            use std::os::windows::fs::MetadataExt;
            const TEMPORARY: u32 = 0x100;
            assert_eq!(own.file_attributes() & TEMPORARY, 0);
        }
    }

    #[test]
    fn what_a_killed_process_left_is_removed_and_what_another_writes_is_not() {
        let folder = tempfile::tempdir().expect("a folder");
        let age = |path: &Path| {
            let file = File::options().write(true).open(path).expect("it opens");
            file.set_modified(SystemTime::now() - Duration::from_secs(60)).expect("its time can be set");
        };
        let left = folder.path().join(".afterlight-left.part");
        fs::write(&left, b"half").expect("written");
        age(&left);
        let fresh = folder.path().join(".afterlight-fresh.part");
        fs::write(&fresh, b"half").expect("written");
        let foreign = folder.path().join(".other.part");
        fs::write(&foreign, b"half").expect("written");
        age(&foreign);
        let writing = WholeFile::begin_in(folder.path()).expect("it can be begun");
        age(writing.0.path());
        let own = writing.0.path().file_name().expect("a name").to_string_lossy().into_owned();

        let mut second = WholeFile::begin_in(folder.path()).expect("it can be begun");
        second.write_all(b"whole").expect("written");
        second.persist(&folder.path().join("result")).expect("put into place");
        let found = names(folder.path());
        assert!(!left.exists() && fresh.exists() && foreign.exists() && found.contains(&own), "{found:?}");
        assert_eq!(fs::read(folder.path().join("result")).expect("readable"), b"whole");
        drop(writing);
        assert!(!names(folder.path()).contains(&own));
    }
}
