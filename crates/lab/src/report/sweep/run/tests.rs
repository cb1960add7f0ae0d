use super::super::assemble::{self, FRONTS, fronts_of};
use super::super::journal::{Contents, FILE, Journal, JournalHeader, JournalRecord, SceneInfo, SceneMeasurements};
use super::super::merge::{self, ShardJournal};
use super::super::model::{Against, LAYOUT, Metric, Report, Shard};
use super::samples::{Clockwork, KILLED, header, info, measure, measure_sweep, measured, report, sweep};
use super::*;

fn sharded(index: u32, count: u32) -> JournalHeader {
    JournalHeader { shard: Some(Shard { index, count }), ..header() }
}

fn part(folder: &std::path::Path, header: &JournalHeader) -> ShardJournal {
    let mut journal = Journal::open(folder, header, false).expect("a journal");
    measure(&mut Clockwork::default(), &mut journal, header.shard).expect("measured");
    journal.add(0, JournalRecord::Done { scene: 0 }).expect("written");
    let contents = Contents::read(&folder.join(FILE)).expect("readable").expect("there");
    ShardJournal { folder: folder.display().to_string(), contents }
}

#[test]
fn what_is_on_a_front_is_measured_again_and_nothing_beats_it() {
    let report = report();
    let scene = &report.scenes[0];
    assert_eq!((scene.points.len(), scene.families.len()), (7, 2));
    assert_eq!(scene.fronts.len(), FRONTS.len());
    for front in &scene.fronts {
        let at = |index: usize| {
            let point = &scene.points[index];
            (point.time.decisive().median, point.errors.against(front.truth).by(front.metric))
        };
        assert!(!front.points.is_empty());
        for &own in &front.points {
            assert!(scene.points[own].time.confirmed, "{}", scene.points[own].name);
            let beaten = (0..scene.points.len()).any(|other| {
                let ((time, error), (own_time, own_error)) = (at(other), at(own));
                time <= own_time && error <= own_error && (time < own_time || error < own_error)
            });
            assert!(!beaten, "{}", scene.points[own].name);
        }
        assert!(front.points.windows(2).all(|pair| at(pair[0]).0 < at(pair[1]).0));
        assert_eq!(front.probability.len(), scene.points.len());
    }
    assert!(assemble::default_on_front(scene, Metric::Flip, FRONTS[5].1).contains("the front"));
}

#[test]
fn only_fronts_that_are_sought_are_confirmed() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut journal = Journal::open(folder.path(), &header(), false).expect("a journal");
    journal
        .add(0, JournalRecord::Scene { scene: 0, info: SceneInfo { fronts: Vec::new(), ..info(&sweep()) } })
        .expect("written");
    let mut meter = Clockwork::default();
    measure_sweep(&sweep(), &mut meter, &mut journal, None).expect("measured");
    assert!(journal.scenes[0].batches.iter().all(|batch| !batch.confirms || batch.points.is_empty()));
    assert_eq!(assemble::scene_report(&journal.scenes[0]).expect("measured").fronts, []);
    assert_eq!(fronts_of(true, Metric::Rmse), [(Metric::Rmse, Against::Converged)]);
    assert_eq!(fronts_of(false, Metric::Rmse), FRONTS);
}

#[test]
fn all_of_a_front_is_confirmed_however_often_others_take_its_place() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let sizes = (0..8).map(|step| SettingsPatch { shadow_size: Some(3000 + 500 * step), ..Default::default() });
    let points = std::iter::once(SettingsPatch::default()).chain(sizes).collect();
    let sweep = Sweep { points, ..sweep() };
    let mut journal = Journal::open(folder.path(), &header(), false).expect("a journal");
    let mut meter = Clockwork { lucky: true, ..Clockwork::default() };
    measure_sweep(&sweep, &mut meter, &mut journal, None).expect("measured");
    let passes = journal.scenes[0].batches.iter().filter(|batch| batch.confirms).count();
    assert!(passes > 5, "{passes}: the sample is none");
    let found = assemble::on_fronts(&journal.scenes[0]);
    let is_confirmed = |name: &str| journal.scenes[0].times_of(name).is_some_and(|(batch, _)| batch.confirms);
    assert!(found.len() > 5 && found.iter().all(|name| name == "default" || is_confirmed(name)), "{found:?}");
}

#[test]
fn times_are_those_that_the_clock_had() {
    let report = report();
    for point in &report.scenes[0].points {
        let expected = match point.name.as_str() {
            "default" => 5.0,
            "shadow-size=512" => 4.25,
            "samples=64" => 320.0,
            _ => continue,
        };
        let ratio = point.time.wall.median / expected;
        assert!((0.99..1.02).contains(&ratio), "{}: {ratio}", point.name);
        assert!(point.time.wall.low <= point.time.wall.median && point.time.wall.median <= point.time.wall.high);
    }
}

#[test]
fn a_run_that_was_stopped_goes_on_and_measures_nothing_twice() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut asked = Clockwork::default();
    let mut stops = 0;
    for _ in 0..100 {
        // As if it was killed after three steps, again and again.
        let mut journal = Journal::open(folder.path(), &header(), false).expect("the same command");
        asked.left = Some(3);
        match measure(&mut asked, &mut journal, None) {
            Ok(()) => break,
            Err(SweepError::Refused(why)) if why == KILLED => stops += 1,
            Err(error) => panic!("{error}"),
        }
    }
    asked.left = None;
    assert!(stops >= 2, "{stops}");
    let whole = tempfile::tempdir().expect("a temporary folder");
    let at_once = measured(whole.path());
    let mut journal = Journal::open(folder.path(), &header(), false).expect("the same command");
    assert_eq!(journal.scenes[0].drawn, at_once[0].drawn);
    assert_eq!(journal.scenes[0].timed(), at_once[0].timed());
    assert_eq!(asked.drawn.len(), at_once[0].drawn.len(), "{:?}", asked.drawn);
    // Once each, and once more for points on a front.
    let times = |name: &str| asked.timed.iter().filter(|timed| *timed == name).count();
    for name in at_once[0].timed() {
        assert!((1..=2).contains(&times(name)), "{name}: {}", times(name));
    }
    let before = asked.timed.len();
    measure(&mut asked, &mut journal, None).expect("nothing is left to do");
    assert_eq!((asked.drawn.len(), asked.timed.len()), (at_once[0].drawn.len(), before));
}

#[test]
fn what_the_device_cannot_hold_is_left_out_with_its_reason() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut journal = Journal::open(folder.path(), &header(), false).expect("a journal");
    let mut meter = Clockwork { too_large: vec!["shadow-size=4096".into()], ..Clockwork::default() };
    measure(&mut meter, &mut journal, None).expect("the others are measured");
    let report = assemble::scene_report(&journal.scenes[0]).expect("measured");
    assert_eq!(report.points.len(), 6);
    assert!(report.left_out.iter().any(|left| left.name == "shadow-size=4096" && left.reason.contains("texels")));
    assert_eq!(
        report.families[0].members.iter().map(|member| member.label.as_str()).collect::<Vec<_>>(),
        ["512", "1024", "2048"]
    );
}

#[test]
fn shards_merge_to_the_points_and_errors_of_the_whole() {
    let whole = report();
    let folders: Vec<_> = (0..3).map(|_| tempfile::tempdir().expect("a temporary folder")).collect();
    let parts: Vec<ShardJournal> =
        folders.iter().zip(1..).map(|(folder, index)| part(folder.path(), &sharded(index, 3))).collect();
    let (header, joined) = merge::join(&parts).expect("they belong together");
    let merged = assemble::report(&header, &joined, None);
    let names = |report: &Report| -> Vec<_> {
        report.scenes[0].points.iter().map(|point| (point.name.clone(), point.errors)).collect()
    };
    assert_eq!(names(&merged), names(&whole));
    let members = |report: &Report| -> Vec<_> {
        report.scenes[0].families.iter().map(|family| (family.key.clone(), family.members.clone())).collect()
    };
    assert_eq!(members(&merged), members(&whole));
    assert_eq!(merged.scenes[0].left_out, whole.scenes[0].left_out);
    // A point on the whole's front was also on its shard's front, and so is measured twice.
    for front in &merged.scenes[0].fronts {
        assert!(front.points.iter().all(|&index| merged.scenes[0].points[index].time.confirmed));
    }
}

#[test]
fn parts_that_do_not_belong_together_are_refused_by_name() {
    let folders: Vec<_> = (0..2).map(|_| tempfile::tempdir().expect("a temporary folder")).collect();
    let one = part(folders[0].path(), &sharded(1, 2));
    let two = part(folders[1].path(), &sharded(2, 2));
    let refused = |parts: &[ShardJournal]| merge::join(parts).expect_err("refused").to_string();
    assert!(merge::join(&[one.clone(), two.clone()]).is_ok());
    assert!(refused(std::slice::from_ref(&one)).contains("shard 2/2 is missing"));
    assert!(refused(&[one.clone(), one.clone()]).contains("both shard 1/2"));
    let changed = |change: &dyn Fn(&mut ShardJournal)| {
        let mut other = two.clone();
        change(&mut other);
        refused(&[one.clone(), other])
    };
    let text = changed(&|part| part.contents.header.machine.device = "another".into());
    assert!(text.contains("tester") && text.contains("another"), "{text}");
    let text = changed(&|part| part.contents.header.machine.cpu = "slower".into());
    assert!(text.contains("CPU is cpu") && text.contains("slower"), "{text}");
    let text = changed(&|part| part.contents.header.layout = 99);
    assert!(text.contains(&format!("layout is {LAYOUT}")) && text.contains("99"), "{text}");
    let text = changed(&|part| {
        part.contents.scenes[0].info.as_mut().expect("measured").size = [1, 1];
    });
    assert!(text.contains("64x36") && text.contains("1x1"), "{text}");
    assert!(changed(&|part| part.contents.header.shard = None).contains("no shard"));
    assert!(changed(&|part| part.contents.scenes[0] = SceneMeasurements::default()).contains("not finished"));
    // Broken off when all points had been measured, and something else had not.
    let text = changed(&|part| part.contents.scenes[0].done = false);
    assert!(text.contains("not finished with builtin:test"), "{text}");
    // A scene's file may have any name: the error stays one line, and the terminal gets no escape.
    let text = changed(&|part| part.contents.header.scenes = vec!["a\n\u{1b}b.gltf".into()]);
    assert!(text.contains(r"and that of this one a\n\u{1b}b.gltf"), "{text}");
}
