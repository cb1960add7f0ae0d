//! Reads a file whole, within a bound. A FIFO would block the reader and a device has no end: neither is read, and nothing beyond the bound.

use std::fs::{self, File, Metadata};
use std::io::{self, ErrorKind, Read};
use std::path::Path;

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
    // The file may grow while it is read, and those of /proc say that they have no bytes.
    file.take(most_bytes.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most_bytes { Err(too_large(most_bytes)) } else { Ok(bytes) }
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
