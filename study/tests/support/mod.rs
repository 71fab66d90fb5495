//! A small study whose rows are made up: a hybrid that is better in mazes, a TD3 that is not, and a classical rival.

#![allow(dead_code, reason = "a module of each test binary, which uses a part")]

use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// Families of the study.
pub(crate) const FAMILIES: [&str; 2] = ["clutter", "maze"];
/// Worlds a family.
pub(crate) const WORLDS: u64 = 30;
/// Training seeds.
pub(crate) const SEEDS: u64 = 10;

/// A folder with `study.toml`, `configs/`, `rows/`.
pub(crate) struct Stage {
    folder: tempfile::TempDir,
}

pub(crate) const STUDY: &str = r#"
title = "Made up <for a test> & nothing else"
inference = "Rows of a test."

[training]
seeds = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10]
env_steps = 1_000_000
updates_min = 90_000

[evaluation]
split = "test"
families = ["clutter", "maze"]
worlds = 30
gates = ["off", "on"]

[interval]
resamples = 200

[[method]]
name = "hybrid"
label = "Hybrid"
train = { config = "configs/hybrid.toml", flags = ["--profile", "quick"] }

[[method]]
name = "td3"
label = "Flat TD3"
train = { config = "configs/td3.toml" }

[[method]]
name = "low"
label = "The hybrid's TD3"
low_level_of = "hybrid"

[[method]]
name = "reactive"
label = "Reactive"
rival = "reactive"

[[primary]]
metric = "success"
method = "hybrid"
against = ["td3"]
families = ["maze"]

[[non_inferiority]]
metric = "success"
margin = 0.02
method = "hybrid"
against = ["td3"]
families = ["clutter"]

[[paired]]
method = "hybrid"
against = ["reactive"]

[ladder]
rungs = [{ method = "td3", removes = "nothing" }, { method = "hybrid", removes = "the horizon" }]

[ablation]
base = "hybrid"
without = ["low"]
"#;

const HEADER: &str = "policy,training_seed,run,family,world_file,split,world_seed,disturbance,lidar,shield,end,\
hit_while_standing,steps,time_s,path_m,geodesic_m,euclidean_m,spl,path_efficiency,path_efficiency_euclidean,smoothness,\
log_jerk,clearance_min_m,clearance_mean_m,time_to_collision_min_s,stood_at_end_s,spin,tick_mean_ns,tick_max_ns";

/// Share of worlds that a method solves.
fn skill(method: &str, family: &str) -> f64 {
    match (method, family) {
        (_, "clutter") => 0.97,
        ("hybrid", _) => 0.9,
        ("reactive", _) => 0.1,
        _ => 0.4,
    }
}

/// A number in 0 to 1 that follows from a text.
fn chance(text: &str) -> f64 {
    let hash = text.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    let mixed = (hash ^ (hash >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (mixed >> 11) as f64 / (1_u64 << 53) as f64
}

/// Rows of a method with a gate, header first.
pub(crate) fn rows(method: &str, seed: Option<u64>, gate: &str) -> String {
    let mut text = format!("{HEADER}\n");
    let seed = seed.map_or(String::new(), |seed| seed.to_string());
    for family in FAMILIES {
        for world in 0..WORLDS {
            let luck = chance(&format!("{method}/{seed}/{family}/{world}"));
            let end = match luck - skill(method, family) {
                d if d < 0.0 => "success",
                d if d < 0.05 => "collision",
                _ => "timeout",
            };
            let (spl, efficiency) = if end == "success" { ("0.9", "0.9") } else { ("0.0", "") };
            let time = 10.0 + 5.0 * luck;
            writeln!(
                text,
                "{method},{seed},run,{family},,test,{world},usual,,{gate},{end},false,100,{time},9.0,8.0,7.0,{spl},{efficiency},\
                 {efficiency},0.95,-12.0,0.2,0.8,,0.0,0.01,50000,90000"
            )
            .expect("a string takes everything");
        }
    }
    text
}

impl Stage {
    /// The whole study.
    pub(crate) fn new() -> Self {
        let stage = Self { folder: tempfile::tempdir().expect("a temporary folder") };
        stage.write("study.toml", STUDY);
        stage.write("configs/hybrid.toml", "");
        stage.write("configs/td3.toml", "algorithm = \"td3\"\n");
        for gate in ["off", "on"] {
            for method in ["hybrid", "td3", "low"] {
                for seed in 1..=SEEDS {
                    stage.compressed(
                        &format!("rows/{method}/seed-{seed}/{gate}.csv.gz"),
                        &rows(method, Some(seed), gate),
                    );
                }
            }
            stage.write(&format!("rows/reactive/{gate}.csv"), &rows("reactive", None, gate));
        }
        for seed in 1..=SEEDS {
            for method in ["hybrid", "td3"] {
                let [curve, scalars] = curve(method, seed);
                stage.compressed(&format!("rows/{method}/seed-{seed}/curve.csv.gz"), &curve);
                stage.write(&format!("rows/{method}/seed-{seed}/scalars.csv"), &scalars);
            }
        }
        stage.write("rows/runs.csv", &runs());
        stage
    }

    /// A path in it.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a file.
    pub(crate) fn write(&self, name: &str, text: &str) {
        fs::write(self.made(name), text).expect("written");
    }

    /// Writes a compressed file.
    pub(crate) fn compressed(&self, name: &str, text: &str) {
        let file = fs::File::create(self.made(name)).expect("made");
        let mut encoder = flate2::write::GzEncoder::new(file, flate2::Compression::fast());
        encoder.write_all(text.as_bytes()).expect("written");
        encoder.finish().expect("written");
    }

    fn made(&self, name: &str) -> PathBuf {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap_or(Path::new("."))).expect("made");
        path
    }
}

/// A curve and its scalars as the trainer writes them: the hybrid's success rises with its return; TD3's falls. The stage of
/// the hybrid's low level comes first, and the steps of its other stage are not the same with every seed.
fn curve(method: &str, seed: u64) -> [String; 2] {
    let families = FAMILIES.map(|family| {
        ["success", "collision", "timeout", "spin"].map(|name| format!("{family}/{name}")).join(",")
    });
    let mut curve = format!("step,hybrid,{}\n", families.join(","));
    let mut scalars = String::from("step,low/reach,low/return,high/return\n");
    let is_hybrid = method == "hybrid";
    for look in 1..=10_u64 {
        let share = look as f64 / 10.0;
        let is_high = is_hybrid && look > 3;
        let steps = look * 100_000 + if is_high { seed * look } else { 0 };
        let noise = 0.05 * chance(&format!("{seed}/{look}"));
        let (success, collision, spin) =
            if is_hybrid { (0.9 * share + noise, 0.05, 0.02) } else { (0.6 - 0.5 * share + noise, 0.3, 0.4) };
        // Families differ by as much as their mean does not.
        let row =
            [0.1, -0.1].map(|more| format!("{},{collision},0.1,{}", success + more, spin - more / 10.0));
        writeln!(curve, "{steps},{},{}", u8::from(is_high), row.join(","))
            .expect("a string takes everything");
        let paid = 10.0 * share + 10.0 * noise;
        let paid = match (is_hybrid, is_high) {
            (true, true) => format!(",{paid}"),
            (true, false) => format!("{},", -paid),
            (false, _) => format!("{},", 100.0 * share),
        };
        writeln!(scalars, "{},0.5,{paid}", steps - 50).expect("a string takes everything");
    }
    [curve, scalars]
}

fn runs() -> String {
    let mut text =
        String::from("method,training_seed,outcome,train_s,env_steps,updates,commit,machine,command,note\n");
    for seed in 1..=SEEDS {
        let outcome = if seed == 7 { "missed" } else { "passed" };
        writeln!(text, "hybrid,{seed},{outcome},300,1000000,95000,abc123,two cores,trainer train,")
            .expect("a string takes everything");
        writeln!(text, "td3,{seed},passed,200,500000,80000,abc123,two cores,trainer train,")
            .expect("a string takes everything");
    }
    text
}
