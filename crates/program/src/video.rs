//! Pictures as a video, which `ffmpeg` encodes.

use std::fs;
use std::io::{self, Read, Write};
use std::process::{Child, ChildStdin, Command, Stdio};

use tempfile::TempDir;

use super::failure::{Exit, Failure};
use super::output::Sink;

/// Extensions of files that `ffmpeg` is asked for.
pub const EXTENSIONS: [&str; 4] = ["mp4", "webm", "mov", "gif"];

/// A video that is being encoded. Dropped before [`Video::finish`], it is gone.
pub struct Video {
    encoder: Child,
    /// Closed when all pictures are there.
    pictures: Option<ChildStdin>,
    /// The folder of the file that is being written.
    folder: TempDir,
    extension: String,
}

impl Video {
    /// Starts `ffmpeg` for a file with this extension.
    ///
    /// # Errors
    /// [`Exit::BadInput`] if `ffmpeg` is not on the path.
    pub fn begin(extension: &str, fps: f64) -> Result<Self, Failure> {
        let folder = tempfile::tempdir().map_err(|error| Failure::write("a temporary folder", &error))?;
        let mut command = Command::new("ffmpeg");
        command.args([
            "-hide_banner",
            "-loglevel",
            "error",
            "-nostdin",
            "-y",
            "-f",
            "image2pipe",
            "-c:v",
            "png",
            "-framerate",
        ]);
        command.arg(fps.to_string()).args(["-i", "-"]);
        // Players decode halved colours alone, which need even sizes.
        if extension != "gif" {
            command.args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"]);
        }
        command.arg(folder.path().join("video").with_extension(extension));
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut encoder = command.spawn().map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => {
                Failure::new(Exit::BadInput, "a video needs ffmpeg, which is not on the path".to_owned())
                    .with_hint("-o NAME.png writes the pictures one by one")
            }
            _ => Failure::new(Exit::BadInput, format!("cannot start ffmpeg: {error}")),
        })?;
        let pictures = encoder.stdin.take();
        Ok(Self { encoder, pictures, folder, extension: extension.to_owned() })
    }

    /// Adds a picture, the bytes of a PNG file.
    ///
    /// # Errors
    /// What `ffmpeg` said, where it ended.
    pub fn add(&mut self, png: &[u8]) -> Result<(), Failure> {
        let Some(pictures) = &mut self.pictures else { return Ok(()) };
        pictures.write_all(png).map_err(|error| {
            let said = self.said();
            failed(&said, &error.to_string())
        })
    }

    /// Waits for the last picture, and writes the file whole.
    ///
    /// # Errors
    /// With the message of `ffmpeg`, or as [`Sink::write`].
    pub fn finish(mut self, sink: &Sink) -> Result<(), Failure> {
        drop(self.pictures.take());
        let said = self.said();
        let unread = |error: io::Error| Failure::write(&sink.to_string(), &error);
        let status = self.encoder.wait().map_err(unread)?;
        if !status.success() {
            return Err(failed(&said, &status.to_string()));
        }
        sink.write(&fs::read(self.folder.path().join("video").with_extension(&self.extension)).map_err(unread)?)
    }

    /// All that it says until it ends.
    fn said(&mut self) -> String {
        let mut said = String::new();
        if let Some(errors) = &mut self.encoder.stderr {
            let _ = errors.read_to_string(&mut said);
        }
        said
    }
}

impl Drop for Video {
    fn drop(&mut self) {
        let _ = self.encoder.kill();
        let _ = self.encoder.wait();
    }
}

fn failed(said: &str, why: &str) -> Failure {
    let line = said.lines().find(|line| !line.trim().is_empty()).unwrap_or(why);
    Failure::new(Exit::BadInput, format!("ffmpeg could not encode the video: {}", line.trim()))
}
