//! The truth, asked for in the background: the object at a place of the picture, and the picture's difference from the true light.
//!
//! A separate thread has a copy of the scene with its tree of boxes. A new question cancels the previous one.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use afterlight::scene::{Scene, Settings, exposure_scale};
use afterlight_truth::reference::shown::{Pixel, shown_at};
use afterlight_truth::reference::{CameraView, Reference, Smith};

/// A question.
pub enum Question {
    /// The object at a place, in pixels from the upper left corner.
    Pick(CameraView, DVec2),
    /// The picture's difference from the truth.
    Error(Box<RenderedFrame>),
}

/// A picture that was drawn, and how.
pub struct RenderedFrame {
    pub view: CameraView,
    pub settings: Settings,
    pub exposure: f32,
    /// RGBA, sRGB-encoded, rows from the top.
    pub picture: Vec<u8>,
}

/// An answer.
#[derive(Debug, Clone, PartialEq)]
pub enum Answer {
    /// The object that was picked, by its index in the scene, and its distance along the view in metres.
    Picked(Option<(usize, f64)>),
    Error(ErrorMap),
}

/// The difference of a picture from the truth at the middle of every `step`-th pixel, in sRGB codes of the brightest channel, of 255.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorMap {
    /// Pixels from one compared pixel to the next.
    pub step: u32,
    /// The number of compared pixels, across and down.
    pub size: [u32; 2],
    /// Rows from the top.
    pub codes: Vec<u8>,
}

impl ErrorMap {
    /// The mean over all that was compared, in codes.
    pub fn mean(&self) -> f64 {
        self.codes.iter().map(|&code| f64::from(code)).sum::<f64>() / self.codes.len().max(1) as f64
    }

    /// The share that is off by more than this many codes.
    pub fn share_above(&self, codes: u8) -> f64 {
        self.codes.iter().filter(|&&code| code > codes).count() as f64 / self.codes.len().max(1) as f64
    }
}

/// Steps between compared pixels, coarse first: an answer comes soon, and better ones follow.
const STEPS: [u32; 4] = [8, 4, 2, 1];

/// Answers for one scene.
pub struct Oracle {
    questions: Sender<(u64, Question)>,
    answers: Receiver<(u64, Answer)>,
    /// The number of the newest question; 0 before the first.
    newest: Arc<AtomicU64>,
}

impl Oracle {
    /// `wake` is called, in the other thread, when there is an answer.
    pub fn new(scene: Scene, wake: impl Fn() + Send + 'static) -> Self {
        let (questions, asked) = channel::<(u64, Question)>();
        let (told, answers) = channel();
        let newest = Arc::new(AtomicU64::new(0));
        let now = Arc::clone(&newest);
        // The thread ends when this side of the channels is gone; dropping them does not wait for it.
        std::thread::spawn(move || {
            // Frames of a scene with faults are refused, with their sentence, before anybody asks about them.
            let Ok(mut reference) = Reference::new(&scene) else { return };
            while let Ok((number, question)) = asked.recv() {
                let tell = |answer| {
                    let told = told.send((number, answer)).is_ok();
                    wake();
                    told
                };
                let is_new = || now.load(Ordering::Relaxed) == number;
                match question {
                    Question::Pick(view, pixel) => {
                        let hit = reference.surface(&view, pixel);
                        tell(Answer::Picked(hit.map(|(_, id, distance)| (id.object as usize, distance))));
                    }
                    Question::Error(drawn) => {
                        reference = reference.with_pinhole_settings(&drawn.settings);
                        for step in STEPS {
                            let map = compare(&reference, &drawn, step, &is_new);
                            if !map.is_some_and(|map| tell(Answer::Error(map))) {
                                break;
                            }
                        }
                    }
                }
            }
        });
        Self { questions, answers, newest }
    }

    /// Asks, in the place of any earlier question.
    pub fn ask(&self, question: Question) {
        let number = self.newest.fetch_add(1, Ordering::Relaxed) + 1;
        // The other side only ends after this one.
        let _ = self.questions.send((number, question));
    }

    /// Drops the last question: its answer is not wanted any more.
    pub fn forget(&self) {
        self.newest.fetch_add(1, Ordering::Relaxed);
    }

    /// The last answer to the newest question that has come since the last call.
    pub fn answer(&self) -> Option<Answer> {
        let newest = self.newest.load(Ordering::Relaxed);
        self.answers.try_iter().filter(|(number, _)| *number == newest).last().map(|(_, answer)| answer)
    }
}

impl Drop for Oracle {
    fn drop(&mut self) {
        self.forget();
    }
}

/// `None` if the answer is not wanted any more.
fn compare(
    reference: &Reference,
    drawn: &RenderedFrame,
    step: u32,
    is_wanted: &(dyn Fn() -> bool + Sync),
) -> Option<ErrorMap> {
    let [width, height] = drawn.view.size;
    let size = [width, height].map(|edge| edge.div_ceil(step));
    let exposure = f64::from(exposure_scale(drawn.exposure));
    let row = |y: u32| {
        let pixel = move |x: u32| [x * step, y * step];
        (0..size[0]).map(|x| code(reference, drawn, pixel(x), exposure)).collect::<Vec<u8>>()
    };
    let rows: Option<Vec<Vec<u8>>> = (0..size[1]).into_par_iter().map(|y| is_wanted().then(|| row(y))).collect();
    Some(ErrorMap { step, size, codes: rows?.concat() })
}

fn code(reference: &Reference, drawn: &RenderedFrame, [x, y]: [u32; 2], exposure: f64) -> u8 {
    let exposed =
        |place: DVec2| DVec3::from_array(reference.light(&drawn.view, Smith::default(), place, place)) * exposure;
    let truth = shown_at(exposed, &drawn.settings, Pixel { place: [x, y], size: drawn.view.size });
    let at = 4 * (y as usize * drawn.view.size[0] as usize + x as usize);
    let own = drawn.picture.get(at..at + 3).unwrap_or(&[0; 3]);
    truth.iter().zip(own).map(|(truth, own)| truth.abs_diff(*own)).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use afterlight_truth::reference::shown::shown;
    use std::time::{Duration, Instant};

    use super::*;
    use afterlight::scene::{OpenOptions, metered_ev100, open};

    const SIZE: [u32; 2] = [24, 16];

    fn wait(oracle: &Oracle, done: impl Fn(&Answer) -> bool) -> Answer {
        let begun = Instant::now();
        loop {
            if let Some(answer) = oracle.answer().filter(&done) {
                return answer;
            }
            assert!(begun.elapsed() < Duration::from_secs(60), "no answer comes");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    #[test]
    fn the_truth_differs_from_itself_by_nothing_and_from_black_by_its_light() {
        let scene = open("builtin:spheres", &OpenOptions::default()).expect("is built in");
        let view = CameraView { camera: scene.camera, size: SIZE };
        let (settings, exposure) = (Settings::default(), metered_ev100(&scene));
        let reference = Reference::new(&scene).expect("a scene");
        let mut picture = Vec::new();
        for index in 0..SIZE[0] * SIZE[1] {
            let place = DVec2::new(f64::from(index % SIZE[0]) + 0.5, f64::from(index / SIZE[0]) + 0.5);
            let light = DVec3::from_array(reference.light(&view, Smith::default(), place, place));
            let pixel = Pixel::numbered(index as usize, SIZE);
            picture.extend(shown(light * f64::from(exposure_scale(exposure)), &settings, pixel));
            picture.push(255);
        }
        let oracle = Oracle::new(scene.clone(), || {});
        let ask = |picture: Vec<u8>| {
            oracle.ask(Question::Error(Box::new(RenderedFrame {
                view,
                settings: settings.clone(),
                exposure,
                picture,
            })));
            match wait(&oracle, |answer| matches!(answer, Answer::Error(map) if map.step == 1)) {
                Answer::Error(map) => map,
                Answer::Picked(_) => unreachable!("filtered"),
            }
        };
        let same = ask(picture.clone());
        assert_eq!((same.size, same.mean(), same.share_above(0)), (SIZE, 0.0, 0.0));
        let black = ask(vec![0; picture.len()]);
        let brightest: Vec<u8> = picture.as_chunks::<4>().0.iter().map(|own| own[0].max(own[1]).max(own[2])).collect();
        assert_eq!(black.codes, brightest);
        assert!(black.mean() > 10.0 && black.share_above(9) > 0.1);
    }

    #[test]
    fn a_place_is_answered_by_what_is_there_and_a_newer_question_takes_the_place_of_an_older() {
        let scene = open("builtin:spheres", &OpenOptions::default()).expect("is built in");
        let view = CameraView { camera: scene.camera, size: SIZE };
        let oracle = Oracle::new(scene.clone(), || {});
        let place = DVec2::new(12.0, 14.0);
        let (_, id, _) = Reference::new(&scene).expect("a scene").surface(&view, place).expect("the floor");
        oracle.ask(Question::Pick(view, DVec2::new(0.5, 0.5)));
        oracle.ask(Question::Pick(view, place));
        let Answer::Picked(Some((object, distance))) = wait(&oracle, |_| true) else { panic!("nothing is there") };
        assert_eq!(object, id.object as usize);
        assert!(distance > 0.0);
        oracle.ask(Question::Pick(view, place));
        oracle.forget();
        std::thread::sleep(Duration::from_millis(50));
        assert_eq!(oracle.answer(), None);
    }
}
