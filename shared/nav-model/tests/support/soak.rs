//! What a soak tells its tests, and what they tell it.
#![allow(dead_code, unreachable_pub, reason = "each test binary uses a part")]

use std::fs::File;
use std::io::Write as _;

/// A number from the environment, for a soak that repeats a test longer and otherwise.
pub fn setting(name: &str, usual: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

/// Says what was counted, and leaves it for the soak's table, if one is being made: a line each.
pub fn count(counts: &[(&str, u64)]) {
    let text: String = counts.iter().map(|(name, number)| format!("{number} {name}\n")).collect();
    print!("{text}");
    if let Some(path) = std::env::var_os("NAV_SOAK_COUNTS") {
        let mut file = File::options().create(true).append(true).open(path).expect("the soak's file");
        file.write_all(text.as_bytes()).expect("written");
    }
}
