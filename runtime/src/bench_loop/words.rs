//! The figures for a person at the terminal.

use super::Phase;
use crate::run::report::row;
use nav_host::terminal::say;

impl Phase {
    /// The priority that the loop had, whatever was asked for.
    fn priority(&self) -> &'static str {
        match (self.realtime, self.realtime_granted) {
            (true, true) => "real-time priority",
            (true, false) => "ordinary priority (real-time was refused)",
            (false, _) => "ordinary priority",
        }
    }
}

/// A phase as a table.
pub(super) fn print_phase(phase: &Phase) {
    let load = if phase.loaded { format!("loaded by {} hogs", phase.hogs) } else { "idle".to_owned() };
    say(format_args!(
        "\n{load}, {}: {} ticks, {} overruns, {} scans replaced by newer ones ({} without an answer at the peer), {} allocations",
        phase.priority(),
        phase.ticks,
        phase.overruns,
        phase.scans_replaced,
        phase.round_trips_missing,
        phase.allocations
    ));
    for word in &phase.granted {
        say(format_args!("  {word}"));
    }
    say(format_args!("{:<34} {:>9} {:>9} {:>9} {:>9}", "us", "p50", "p99", "p99.9", "max"));
    let rows = [
        ("scan to command", &phase.scan_to_command),
        ("scan to command at the peer", &phase.round_trip),
        ("wake-up to command", &phase.tick),
        ("controller and networks", &phase.controller),
        ("wake-up late at a deadline", &phase.wake_late),
        ("period to period", &phase.jitter),
    ];
    for (name, percentiles) in rows.into_iter().filter(|(_, p)| p.count > 0) {
        say(row(name, percentiles));
    }
}

/// What a machine's figures still say on another machine.
pub(super) fn print_ratios(phases: &[Phase]) {
    let find = |loaded, realtime| phases.iter().find(|p| p.loaded == loaded && p.realtime == realtime);
    for realtime in [false, true] {
        if let (Some(idle), Some(loaded)) = (find(false, realtime), find(true, realtime)) {
            let ratio = |of: fn(&Phase) -> u64| of(loaded) as f64 / of(idle).max(1) as f64;
            say(format_args!(
                "\n{}, loaded over idle: scan to command p50 {:.1}x, p99 {:.1}x; jitter p99 {:.1}x",
                loaded.priority(),
                ratio(|p| p.scan_to_command.p50_ns),
                ratio(|p| p.scan_to_command.p99_ns),
                ratio(|p| p.jitter.p99_ns)
            ));
        }
    }
}
