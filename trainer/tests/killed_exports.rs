//! `trainer export` killed at any moment, while somebody reads the folder: one whole model or the other, never a mixture,
//! never none; and what killed exports leave is removed by the next one.
//!
//! `NAV_SOAK_SEED` and `NAV_EXPORT_KILLS` say which moments and how many; what was counted goes to the file `NAV_SOAK_COUNTS`.

mod support;

use nav_model::model::Model;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Child;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use support::soak::{count, setting};
use support::{TINY, silent};

/// Far more than an export takes; only against waiting for ever.
const PATIENCE: Duration = Duration::from_secs(120);

/// Folders beside the model that an export works in.
fn beside(here: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(here).expect("the folder").flatten().map(|entry| entry.path());
    entries
        .filter(|path| {
            path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(".models.new-"))
        })
        .collect()
}

fn export(here: &Path, run: u64) -> Child {
    let run = format!("runs/{run}");
    silent(here, &["export", "--run", &run, "--out", "models"]).spawn().expect("the trainer starts")
}

/// Waits until the export works on its folder (or no longer does); `None` if it ended before.
fn wait_for(here: &Path, child: &mut Child, is_working: bool) -> Option<()> {
    let asked = Instant::now();
    let own = here.join(format!(".models.new-{}", child.id()));
    while own.exists() != is_working {
        if child.try_wait().expect("our own child").is_some() {
            return None;
        }
        assert!(asked.elapsed() < PATIENCE, "the export does not go on");
    }
    Some(())
}

/// Numbers in `[0, 1)`, the same for the same seed.
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 40) as f64 / (1 << 24) as f64
    }
}

/// How long an undisturbed export takes until it has its own folder, and works in it.
fn measure(here: &Path, run: u64) -> [Duration; 2] {
    let started = Instant::now();
    let mut child = export(here, run);
    wait_for(here, &mut child, true).expect("it makes a folder");
    let appeared = started.elapsed();
    let _ = wait_for(here, &mut child, false);
    let worked = started.elapsed() - appeared;
    assert!(child.wait().expect("reaped").success(), "it exports");
    [appeared, worked]
}

#[test]
fn whoever_reads_while_exports_are_killed_finds_a_whole_model() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    std::fs::write(here.join("tiny.toml"), TINY).expect("written");
    for seed in ["1", "2"] {
        let out = format!("runs/{seed}");
        let train =
            ["train", "--config", "tiny.toml", "--algorithm", "td3", "--seed", seed, "--out", out.as_str()];
        assert!(silent(here, &train).status().expect("it starts").success(), "it trains");
    }
    let models = here.join("models");
    measure(here, 1);
    std::fs::create_dir(models.join("pictures")).expect("made");
    std::fs::write(models.join("pictures/one.png"), "mine").expect("written");
    std::fs::write(models.join("notes.txt"), "mine").expect("written");
    let [appeared, worked] = measure(here, 1);

    let kills = setting("NAV_EXPORT_KILLS", 12);
    let mut dice = Dice(setting("NAV_SOAK_SEED", 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
    let (mut killed, mut replaced, mut left) = (0, 0, 0);
    let is_over = AtomicBool::new(false);
    let seeds = std::thread::scope(|scope| {
        let reader = scope.spawn(|| {
            let mut seeds = Vec::new();
            while !is_over.load(Ordering::Relaxed) {
                seeds.push(Model::read(&models).map(|model| model.manifest().seed));
            }
            seeds
        });
        for kill in 0..kills {
            let run = 2 - kill % 2;
            let before = Model::read(&models).expect("whole").manifest().seed;
            let mut child = export(here, run);
            // Half of them anywhere, the others while it works in its folder and exchanges it.
            if kill % 4 < 2 {
                std::thread::sleep((appeared + worked).mul_f64(dice.roll()));
            } else if wait_for(here, &mut child, true).is_some() {
                std::thread::sleep(worked.mul_f64(dice.roll()));
            }
            child.kill().expect("our own child");
            killed += u64::from(!child.wait().expect("reaped").success());
            left += u64::from(!beside(here).is_empty());
            let after = Model::read(&models).unwrap_or_else(|error| panic!("kill {kill}: {error}"));
            replaced += u64::from(after.manifest().seed != before);
        }
        is_over.store(true, Ordering::Relaxed);
        reader.join().expect("no panic")
    });
    let read: Result<Vec<u64>, _> = seeds.into_iter().collect();
    let read = read.unwrap_or_else(|error| panic!("a reader found: {error}"));
    assert!(read.iter().copied().collect::<BTreeSet<_>>().is_subset(&BTreeSet::from([1, 2])));
    println!(
        "an export: {appeared:?} until it has a folder, {worked:?} in it; {killed} of {kills} killed, {left} left something, \
         {replaced} had replaced the model; {} whole models read meanwhile",
        read.len()
    );
    assert!(killed > 0 && left > 0, "the moments matter: {killed} killed, {left} left something behind");
    count(&[
        ("exports killed", killed),
        ("killed exports that left something", left),
        ("killed or late exports that had replaced the model", replaced),
        ("models read meanwhile, all whole", read.len() as u64),
    ]);
    assert!(export(here, 2).wait().expect("reaped").success(), "the next one exports");
    assert_eq!(Model::read(&models).expect("whole").manifest().seed, 2);
    assert_eq!(beside(here), Vec::<PathBuf>::new(), "what killed exports left is gone");
    for file in ["pictures/one.png", "notes.txt"] {
        assert_eq!(std::fs::read_to_string(models.join(file)).expect(file), "mine");
    }
}
