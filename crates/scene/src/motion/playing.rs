//! The clips that play, and the moment's place in each of them.

use std::collections::HashSet;

use super::{Clip, Motion};
use crate::{Error, unknown};

/// The clips of a scene that play.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum ClipChoice {
    /// All of them at once. If two move the same target, the later one wins.
    #[default]
    All,
    /// The clips with these indices in [`Motion::clips`], in this order. If two move the same target, the later one wins.
    Only(Vec<usize>),
    /// No clips: everything is at rest.
    None,
}

/// A moment.
#[derive(Debug, Clone, PartialEq)]
pub struct Playing {
    /// Seconds since the clips began.
    pub time: f64,
    /// The clips that play.
    pub clips: ClipChoice,
    /// True if each clip begins again when its own duration is over; else it stays at its end.
    pub looped: bool,
}

impl Default for Playing {
    fn default() -> Self {
        Self { time: 0.0, clips: ClipChoice::All, looped: true }
    }
}

impl Playing {
    /// All clips at `time` seconds after their beginning, looped.
    pub fn at(time: f64) -> Self {
        Self { time, ..Self::default() }
    }

    /// Returns the same choice of clips at another time.
    #[must_use]
    pub fn with_time(&self, time: f64) -> Self {
        Self { time, ..self.clone() }
    }

    /// Returns the place of the moment in the clip, in seconds. A clip without a duration has one moment only.
    pub fn time_in(&self, clip: &Clip) -> f64 {
        let duration = clip.duration();
        // The remainder of two doubles is exact, also after a million seconds.
        let wraps = self.looped && duration > 0.0 && duration.is_finite() && !(0.0..=duration).contains(&self.time);
        if wraps { self.time.rem_euclid(duration) } else { self.time }
    }
}

impl Motion {
    /// The clips that play, in their order.
    pub fn playing<'a>(&'a self, choice: &'a ClipChoice) -> impl Iterator<Item = &'a Clip> {
        let (all, only): (&[Clip], &[usize]) = match choice {
            ClipChoice::All => (&self.clips, &[]),
            ClipChoice::Only(indices) => (&[], indices),
            ClipChoice::None => (&[], &[]),
        };
        all.iter().chain(only.iter().filter_map(|&index| self.clips.get(index)))
    }

    /// Returns the duration of the longest clip that plays, in seconds.
    pub fn duration(&self, choice: &ClipChoice) -> f64 {
        self.playing(choice).map(Clip::duration).fold(0.0, f64::max)
    }

    /// The clips that play by default: all, but if several move the same target, as a walk and a run of one figure do, only the first of them.
    pub fn usual_clips(&self) -> ClipChoice {
        let mut moved = HashSet::new();
        let mut is_usual = |clip: &Clip| {
            let is_free = clip.channels.iter().all(|channel| !moved.contains(&channel.target));
            if is_free {
                moved.extend(clip.channels.iter().map(|channel| channel.target));
            }
            is_free
        };
        let usual: Vec<usize> = (0..self.clips.len()).filter(|&index| is_usual(&self.clips[index])).collect();
        if usual.len() == self.clips.len() { ClipChoice::All } else { ClipChoice::Only(usual) }
    }

    /// The clips with these names, all of them if several share a name. `all` selects all clips and `none` no clip, unless a clip has that name. A
    /// clip's number, counted from 0, is also accepted unless a clip has it as its name: files need not name their clips. An empty list selects
    /// [`Motion::usual_clips`].
    ///
    /// # Errors
    /// [`Error::Setting`] for an unknown name, with the names that exist.
    pub fn choose(&self, names: &[String]) -> Result<ClipChoice, Error> {
        let mut chosen = Vec::new();
        for name in names {
            let before = chosen.len();
            chosen.extend((0..self.clips.len()).filter(|&index| self.clips[index].name == *name));
            if chosen.len() > before || name == "none" {
                continue;
            }
            if name == "all" {
                chosen.extend(0..self.clips.len());
                continue;
            }
            match name.parse::<usize>().ok().filter(|&index| index < self.clips.len()) {
                Some(index) => chosen.push(index),
                None if self.clips.is_empty() => {
                    return Err(Error::Setting(format!("there is no clip {name:?}: the scene has no clips")));
                }
                None => {
                    let mut names: Vec<&str> = self.clips.iter().map(|clip| clip.name.as_str()).collect();
                    let words: Vec<&str> = ["all", "none"].into_iter().filter(|word| !names.contains(word)).collect();
                    names.extend(words);
                    return Err(Error::Setting(unknown("clip", name, &names)));
                }
            }
        }
        Ok(if chosen.is_empty() && names.is_empty() {
            self.usual_clips()
        } else if chosen.is_empty() {
            ClipChoice::None
        } else {
            ClipChoice::Only(chosen)
        })
    }
}
