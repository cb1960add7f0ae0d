//! Reads a file whole, within a bound. A FIFO would block the reader and a device has no end: neither is read, and nothing beyond the bound. A file
//! that a command line names may be a pipe that something writes.

use std::fs::{self, File, Metadata};
use std::io::{self, ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

/// Time in which a FIFO must be opened for writing. A shell starts the writer of `<(command)` before the reader, so the longest wait is for a process
/// to start on a busy machine.
const FOR_A_WRITER: Duration = Duration::from_secs(2);

/// Reads all of a regular file, through symbolic links.
///
/// # Errors
/// When it cannot be read, is a directory or no regular file, or has more than `most_bytes`.
pub fn read_regular(path: &Path, most_bytes: u64) -> io::Result<Vec<u8>> {
    // Asked before it is opened: to open a FIFO blocks, and to open a device may start it.
    check(&fs::metadata(path)?, most_bytes)?;
    let file = File::open(path)?;
    // Asked again, because another process may have put another file there.
    let length = check(&file.metadata()?, most_bytes)?;
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(usize::try_from(length).map_err(|_| too_large(most_bytes))?)?;
    // The file may grow while it is read, and files in /proc report a size of 0.
    file.take(most_bytes.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most_bytes { Err(too_large(most_bytes)) } else { Ok(bytes) }
}

/// Reads all of a file that a command line names: a regular file, a pipe that something writes, as a shell makes one of `<(command)`, or the null device.
///
/// # Errors
/// As [`read_regular`], and when nothing opens a FIFO for writing within two seconds.
pub fn read_given(path: &Path, most_bytes: u64) -> io::Result<Vec<u8>> {
    if is_null(path) {
        return Ok(Vec::new());
    }
    if !is_pipe(&fs::metadata(path)?) {
        return read_regular(path, most_bytes);
    }
    let (opened, waiting) = mpsc::channel();
    let own: PathBuf = path.to_owned();
    // Opening blocks until a process opens the pipe for writing, so a thread opens it. If no process ever writes, this thread stays blocked until the program ends.
    thread::Builder::new().spawn(move || _ = opened.send(File::open(own)))?;
    let without_writer = |_| io::Error::new(ErrorKind::TimedOut, "it is a pipe (FIFO) that nothing writes");
    let file = waiting.recv_timeout(FOR_A_WRITER).map_err(without_writer)??;
    let mut bytes = Vec::new();
    file.take(most_bytes.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most_bytes { Err(too_large(most_bytes)) } else { Ok(bytes) }
}

/// Returns true for the null device, which scripts name in place of an empty file.
fn is_null(path: &Path) -> bool {
    cfg!(unix) && fs::canonicalize(path).is_ok_and(|real| real == Path::new("/dev/null"))
}

#[cfg(unix)]
fn is_pipe(about: &Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    about.file_type().is_fifo()
}

/// Returns false: shells of Windows hand no pipes to programs by name.
#[cfg(not(unix))]
fn is_pipe(_: &Metadata) -> bool {
    false
}

/// Returns the length of a file that may be read.
fn check(about: &Metadata, most_bytes: u64) -> io::Result<u64> {
    if about.is_dir() {
        return Err(io::Error::new(ErrorKind::IsADirectory, "it is a directory"));
    }
    if !about.is_file() {
        return Err(io::Error::new(ErrorKind::InvalidInput, "it is not a regular file"));
    }
    if about.len() > most_bytes { Err(too_large(most_bytes)) } else { Ok(about.len()) }
}

fn too_large(most_bytes: u64) -> io::Error {
    io::Error::new(ErrorKind::FileTooLarge, format!("it has more than {most_bytes} bytes"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_up_to_the_bound_and_not_beyond() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("file");
        fs::write(&file, b"12345").expect("written");
        assert_eq!(read_regular(&file, 5).expect("read"), b"12345");
        let error = read_regular(&file, 4).expect_err("too large");
        assert_eq!((error.kind(), error.to_string().as_str()), (ErrorKind::FileTooLarge, "it has more than 4 bytes"));
        // A sparse file: no memory is asked for.
        File::create(&file).and_then(|file| file.set_len(1 << 40)).expect("a long file");
        assert_eq!(read_regular(&file, 1 << 30).expect_err("too large").kind(), ErrorKind::FileTooLarge);
        fs::write(&file, b"").expect("written");
        assert_eq!(read_regular(&file, 0).expect("read"), b"");
        let missing = read_regular(&folder.path().join("missing"), 5).expect_err("missing");
        assert_eq!(missing.kind(), ErrorKind::NotFound);
        let directory = read_regular(folder.path(), 1 << 20).expect_err("a directory");
        assert_eq!((directory.kind(), directory.to_string().as_str()), (ErrorKind::IsADirectory, "it is a directory"));
    }

    #[test]
    #[cfg(unix)]
    fn a_pipe_is_read_where_something_writes_it_and_refused_where_nothing_does() {
        use std::io::Write;
        let folder = tempfile::tempdir().expect("a folder");
        let [silent, written] = ["silent", "written"].map(|name| folder.path().join(name));
        let made = std::process::Command::new("mkfifo").args([&silent, &written]).status();
        assert!(made.is_ok_and(|status| status.success()), "mkfifo");
        let error = read_given(&silent, 5).expect_err("nothing writes it");
        assert_eq!(error.to_string(), "it is a pipe (FIFO) that nothing writes");
        let other = written.clone();
        // Opened and written in two steps, as by a process that computes meanwhile.
        let writer = thread::spawn(move || {
            let mut file = File::options().write(true).open(other)?;
            thread::sleep(Duration::from_millis(20));
            file.write_all(b"12345")
        });
        assert_eq!(read_given(&written, 5).expect("read"), b"12345");
        assert!(writer.join().is_ok_and(|written| written.is_ok()));
        assert_eq!(read_given(Path::new("/dev/null"), 5).expect("empty"), b"");
        let error = read_given(Path::new("/dev/zero"), 5).expect_err("it has no end");
        assert_eq!(error.to_string(), "it is not a regular file");
        fs::write(folder.path().join("file"), b"12345").expect("written");
        assert_eq!(read_given(&folder.path().join("file"), 5).expect("read"), b"12345");
    }

    #[test]
    #[cfg(unix)]
    fn links_are_followed_and_what_is_no_regular_file_is_refused_at_once() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| folder.path().join(name);
        fs::write(path("file"), b"12345").expect("written");
        symlink(path("file"), path("link")).expect("linked");
        assert_eq!(read_regular(&path("link"), 5).expect("read"), b"12345");
        symlink(path("loop"), path("loop")).expect("linked");
        assert!(read_regular(&path("loop"), 5).is_err());
        symlink(path("nothing"), path("dangling")).expect("linked");
        assert_eq!(read_regular(&path("dangling"), 5).expect_err("nothing").kind(), ErrorKind::NotFound);
        symlink("/dev/zero", path("zero")).expect("linked");
        let made = std::process::Command::new("mkfifo").arg(path("fifo")).status();
        assert!(made.is_ok_and(|status| status.success()), "mkfifo");
        let _socket = std::os::unix::net::UnixListener::bind(path("socket")).expect("a socket");
        for name in ["zero", "fifo", "socket"] {
            let error = read_regular(&path(name), u64::MAX).expect_err(name);
            assert_eq!(error.to_string(), "it is not a regular file", "{name}");
        }
        // It says that it has no bytes, and has some.
        #[cfg(target_os = "linux")]
        {
            let all = read_regular(Path::new("/proc/self/status"), 1 << 20).expect("read");
            assert!(all.len() > 100);
            assert!(read_regular(Path::new("/proc/self/status"), 100).is_err());
        }
    }
}
