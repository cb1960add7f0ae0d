//! Commands that this program prints for its user to type. Each is built from the arguments of the running command, so that it draws the same scene
//! with the same settings on the same device. Debug builds parse each again.

use std::ffi::{OsStr, OsString};
use std::fmt;

use super::args::{DeviceArgs, SettingsArgs};

/// A command of this program, word for word.
#[derive(Debug, Clone)]
pub struct Typed {
    subcommand: &'static str,
    /// The scenes or files that it is about.
    about: Vec<OsString>,
    /// Options with their values.
    options: Vec<OsString>,
}

impl Typed {
    pub fn new(subcommand: &'static str) -> Self {
        Self { subcommand, about: Vec::new(), options: Vec::new() }
    }

    /// Adds a scene or a file.
    pub fn about(mut self, what: impl AsRef<OsStr>) -> Self {
        self.about.push(what.as_ref().to_owned());
        self
    }

    /// Adds an option without a value if it is given.
    pub fn flag(mut self, name: &str, is_given: bool) -> Self {
        self.options.extend(is_given.then(|| format!("--{name}").into()));
        self
    }

    /// Adds an option with its value.
    pub fn option(mut self, name: &str, value: impl AsRef<OsStr>) -> Self {
        let (mut option, value) = (OsString::from(format!("--{name}")), value.as_ref());
        // Behind an equals sign a value may look like an option.
        if value.as_encoded_bytes().first().is_none_or(|first| *first == b'-') {
            option.push("=");
            option.push(value);
            self.options.push(option);
        } else {
            self.options.extend([option, value.to_owned()]);
        }
        self
    }

    /// Adds an option if it has a value.
    pub fn option_if(self, name: &str, value: Option<impl AsRef<OsStr>>) -> Self {
        match value {
            Some(value) => self.option(name, value),
            None => self,
        }
    }

    /// Adds all options of drawing that the running command was given, `--settings` among them.
    pub fn drawing(self, args: &SettingsArgs) -> Self {
        self.of(args, |_| true)
    }

    /// Adds the options of drawing that the running command was given and that no settings file can hold: scale, camera, time, sky.
    pub fn loading(self, args: &SettingsArgs) -> Self {
        let beside = SettingsArgs::beside_settings();
        self.of(args, |name| beside.iter().any(|own| own == name))
    }

    fn of(self, args: &SettingsArgs, is_taken: impl Fn(&str) -> bool) -> Self {
        let taken = args.written.iter().filter(|(name, _)| is_taken(name));
        taken.fold(self, |typed, (name, value)| match value {
            Some(value) => typed.option(name, value),
            None => typed.flag(name, true),
        })
    }

    /// Adds the device that the running command was given.
    pub fn on(self, args: &DeviceArgs) -> Self {
        self.option_if("device", args.device.as_ref().map(ToString::to_string))
    }

    /// The words behind the program's name.
    fn words(&self) -> Vec<OsString> {
        let mut words = vec![OsString::from(self.subcommand)];
        // What is named like an option stands behind two dashes.
        let (odd, plain): (Vec<_>, Vec<_>) =
            self.about.iter().partition(|what| what.as_encoded_bytes().starts_with(b"-"));
        words.extend(plain.into_iter().chain(&self.options).cloned());
        if !odd.is_empty() {
            words.push("--".into());
            words.extend(odd.into_iter().cloned());
        }
        words
    }
}

impl fmt::Display for Typed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words = self.words();
        debug_assert!(super::parses(&words), "{words:?} is printed, and cannot be typed");
        f.write_str("afterlight")?;
        words.iter().try_for_each(|word| write!(f, " {}", quoted(word)))
    }
}

/// A word of a command line as a shell takes it.
pub fn quoted(word: impl AsRef<OsStr>) -> String {
    let word = word.as_ref();
    let Some(text) = word.to_str() else {
        // bash, zsh, ksh and newer POSIX shells have this form for bytes that are no text.
        let bytes = word.as_encoded_bytes().escape_ascii().to_string();
        return format!("$'{}'", bytes);
    };
    let is_plain = |c: char| c.is_alphanumeric() || ":/._-,=+%@".contains(c);
    // Within double quotes a shell reads these, and Windows' own shell knows no other quotes.
    let is_read = |c: char| "\"$`\\!".contains(c) || c.is_control();
    if !text.is_empty() && text.chars().all(is_plain) {
        text.to_owned()
    } else if text.chars().any(is_read) && cfg!(unix) {
        format!("'{}'", text.replace('\'', "'\\''"))
    } else {
        format!("\"{text}\"")
    }
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use std::os::unix::ffi::{OsStrExt, OsStringExt};
    use std::process::Command;

    use clap::{CommandFactory, FromArgMatches};

    use super::*;
    use crate::Cli;

    /// The words that a shell makes of a line.
    fn words(line: &str) -> Vec<OsString> {
        let script = format!("set -- {line}\nprintf '%s\\0' \"$@\"");
        let output = Command::new("bash").args(["-c", &script]).output().expect("a shell");
        let mut words: Vec<_> =
            output.stdout.split(|byte| *byte == 0).map(|word| OsString::from_vec(word.to_vec())).collect();
        words.pop();
        words
    }

    /// The scene and the options of a command line.
    fn parsed(words: impl IntoIterator<Item = OsString>) -> (String, SettingsArgs, DeviceArgs) {
        let matches = Cli::command().try_get_matches_from(words).unwrap_or_else(|error| panic!("{error}"));
        let (_, own) = matches.subcommand().expect("a subcommand");
        let settings = SettingsArgs::from_arg_matches(own).expect("options of drawing");
        let device = DeviceArgs::from_arg_matches(own).expect("options of the device");
        (own.get_one::<String>("scene").expect("a scene").clone(), settings, device)
    }

    #[test]
    fn a_shell_reads_each_word_as_it_was() {
        let odd = OsStr::from_bytes(b"caf\xe9 'x'");
        let all = [
            "",
            "a b",
            "a\"b",
            "$HOME",
            "`x`",
            "it's",
            "a\\b",
            "!!",
            "~/x",
            "*",
            "a\nb",
            "#x",
            "-1,2,3/0,0,0/40",
            "b?x=1&y=2",
            "k=v",
        ];
        let line: String = all.iter().map(OsStr::new).chain([odd]).map(|word| quoted(word) + " ").collect();
        let expected: Vec<OsString> = all.iter().map(OsString::from).chain([odd.to_owned()]).collect();
        assert_eq!(words(&line), expected, "{line}");
    }

    #[test]
    fn a_printed_command_parses_to_the_arguments_that_it_was_made_of() {
        // Each option of drawing that is no setting, with values that a shell would like to read.
        let given = [
            "--settings",
            "my settings.toml",
            "--camera",
            "-1,2,3/0,0,0/40",
            "--scale",
            "0.01",
            "--up",
            "z",
            "--time",
            "2.5",
            "--clip",
            "walk $fast",
            "--clip",
            "2",
            "--scene",
            "Scene \"A\"",
            "--variant=-v",
            "--light",
            "my room's.hdr",
            "--sky",
            "a sky's.hdr",
            "--sky-rotation=-30",
            "--sky-strength",
            "100",
            "--allow-outside",
            "--size",
            "64x36",
            "--shadows",
            "off",
            "--exposure=-2.5",
            "--gbuffer",
            "lean,normal=rgb8",
            "--device",
            "llvm pipe",
        ];
        for scene in ["builtin:field?objects=20&lights=4", "my $model's.glb", "-odd.obj"] {
            let line = ["afterlight", "inspect"].into_iter().chain(given).chain(["--", scene]);
            let (_, drawing, device) = parsed(line.map(OsString::from));
            let beside = SettingsArgs::beside_settings();
            let missing = beside.iter().find(|name| drawing.written.iter().all(|(own, _)| own != *name));
            assert_eq!(missing, None, "the test does not give it");
            let printed = Typed::new("inspect").about(scene).drawing(&drawing).on(&device).to_string();
            let (own, again, on) = parsed(words(&printed));
            assert_eq!((own.as_str(), format!("{again:?}")), (scene, format!("{drawing:?}")), "{printed}");
            assert_eq!(on.device, device.device, "{printed}");
            // Beside a settings file only the options are typed that it cannot hold.
            let loading = Typed::new("inspect").about(scene).loading(&drawing).to_string();
            let (_, again, _) = parsed(words(&loading));
            assert_eq!((again.said, again.file), Default::default(), "{loading}");
            let kept: Vec<_> = drawing.written.iter().filter(|(name, _)| beside.contains(name)).cloned().collect();
            assert_eq!(again.written, kept, "{loading}");
        }
    }
}
