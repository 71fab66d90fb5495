//! How far a stage is: a bar on a terminal, a plain line every ten seconds elsewhere (a log, a CI job).

use std::io::{IsTerminal, stderr};
use std::time::{Duration, Instant};

use nav_host::terminal::{Level, debug, escaped, note, says, warn};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Time between two plain lines.
const LINE_PERIOD: Duration = Duration::from_secs(10);
/// Time over which a rate forgets.
const RATE_MEMORY: Duration = Duration::from_secs(10);

/// What there is to tell.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Status {
    /// How much of the stage is done, in the unit of its total.
    pub position: u64,
    /// Environment steps so far.
    pub steps: u64,
    /// Learner updates so far.
    pub updates: u64,
    /// Share of the recent episodes that reached the goal, once there are some.
    pub success: Option<f32>,
}

/// The display of one stage.
#[derive(Debug)]
pub struct Progress {
    stage: String,
    total: u64,
    started: Instant,
    first: Option<Status>,
    last: (Instant, Status),
    steps: Rate,
    updates: Rate,
    /// Nothing where there is no terminal.
    bar: Option<ProgressBar>,
    last_line: Option<Instant>,
}

impl Progress {
    /// Begins a stage of `total` units on standard error.
    pub fn new(stage: &str, total: u64) -> Self {
        let bar = (stderr().is_terminal() && says(Level::Info)).then(|| {
            let style = ProgressStyle::with_template("{prefix:>12} {bar:30} {percent:>3} %  {msg}")
                .expect("the template is valid")
                .progress_chars("=> ");
            let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr_with_hz(4));
            bar.with_style(style).with_prefix(stage.to_owned())
        });
        let now = Instant::now();
        Self {
            stage: stage.to_owned(),
            total,
            started: now,
            first: None,
            last: (now, Status::default()),
            steps: Rate::default(),
            updates: Rate::default(),
            bar,
            last_line: None,
        }
    }

    /// Shows a new state; call as often as convenient. The first call of a resumed stage sets where its rates
    /// and its remaining time count from.
    pub fn update(&mut self, status: Status) {
        let now = Instant::now();
        if self.first.is_none() {
            self.first = Some(status);
            self.started = now;
        } else {
            let (time, before) = self.last;
            let elapsed = now - time;
            self.steps.add(status.steps.saturating_sub(before.steps), elapsed);
            self.updates.add(status.updates.saturating_sub(before.updates), elapsed);
        }
        self.last = (now, status);
        if let Some(bar) = &self.bar {
            bar.set_position(status.position);
            bar.set_message(self.text(now));
        } else if self.last_line.is_none_or(|line| now - line >= LINE_PERIOD) {
            self.last_line = Some(now);
            self.print(now);
        }
    }

    /// Prints a warning on a line of its own, above the bar.
    pub fn warn(&self, line: &str) {
        match &self.bar {
            Some(bar) => bar.println(escaped(line)),
            None => warn(line),
        }
    }

    /// The same with what helps to find a mistake.
    pub fn debug(&self, line: &str) {
        match &self.bar {
            Some(bar) if says(Level::Debug) => bar.println(escaped(line)),
            Some(_) => {}
            None => debug(line),
        }
    }

    /// Ends the stage, leaving its last state on the screen.
    pub fn finish(self) {
        match &self.bar {
            Some(bar) => bar.abandon(),
            None => self.print(Instant::now()),
        }
    }

    fn print(&self, now: Instant) {
        let percent = 100 * self.last.1.position / self.total.max(1);
        note(format_args!("{:>12} {percent:>3} %  {}", self.stage, self.text(now)));
    }

    /// Everything after the percentage.
    fn text(&self, now: Instant) -> String {
        let (_, status) = self.last;
        let done = status.position.saturating_sub(self.first.map_or(0, |first| first.position));
        let left = remaining(done, self.total.saturating_sub(status.position), now - self.started);
        describe(&status, self.steps.per_second(), self.updates.per_second(), left)
    }
}

/// A rate that follows the last seconds.
#[derive(Debug, Clone, Copy, Default)]
struct Rate {
    count: f64,
    seconds: f64,
}

impl Rate {
    fn add(&mut self, count: u64, elapsed: Duration) {
        let kept = (-elapsed.as_secs_f64() / RATE_MEMORY.as_secs_f64()).exp();
        self.count = self.count * kept + count as f64;
        self.seconds = self.seconds * kept + elapsed.as_secs_f64();
    }

    fn per_second(&self) -> f64 {
        if self.seconds > 0.0 { self.count / self.seconds } else { 0.0 }
    }
}

/// Time left when `left` goes as `done` went; nothing before there is anything to go by.
fn remaining(done: u64, left: u64, elapsed: Duration) -> Option<Duration> {
    let seconds = elapsed.as_secs_f64() * left as f64 / done as f64;
    if done > 0 { Duration::try_from_secs_f64(seconds).ok() } else { None }
}

fn describe(status: &Status, steps: f64, updates: f64, left: Option<Duration>) -> String {
    let success = status.success.map_or("  --".to_owned(), |share| format!("{:4.1}", 100.0 * share));
    let left = left.map_or("--".to_owned(), |left| {
        let seconds = left.as_secs();
        format!("{}:{:02}", seconds / 60, seconds % 60)
    });
    format!("success {success} %  {steps:>7.0} steps/s  {updates:>5.0} updates/s  ETA {left}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_follows_the_last_seconds() {
        let mut rate = Rate::default();
        assert!(rate.per_second() == 0.0);
        (0..100).for_each(|_| rate.add(50, Duration::from_millis(500)));
        assert!((rate.per_second() - 100.0).abs() < 1e-6);
        (0..100).for_each(|_| rate.add(10, Duration::from_millis(500)));
        assert!((rate.per_second() - 20.0).abs() < 1.0, "{}", rate.per_second());
    }

    #[test]
    fn the_remaining_time_goes_by_what_was_done() {
        let elapsed = Duration::from_secs(30);
        assert_eq!(remaining(100, 300, elapsed), Some(Duration::from_secs(90)));
        assert_eq!(remaining(0, 300, elapsed), None);
    }

    #[test]
    fn a_line_names_every_figure() {
        let status = Status { success: Some(0.875), ..Status::default() };
        let line = describe(&status, 12_345.0, 410.0, Some(Duration::from_secs(125)));
        assert_eq!(line, "success 87.5 %    12345 steps/s    410 updates/s  ETA 2:05");
        let line = describe(&Status::default(), 0.0, 0.0, None);
        assert_eq!(line, "success   -- %        0 steps/s      0 updates/s  ETA --");
    }

    #[test]
    fn a_resumed_stage_counts_from_where_it_resumed() {
        let mut progress = Progress::new("low level", 1000);
        progress.update(Status { position: 900, steps: 900_000, ..Status::default() });
        std::thread::sleep(Duration::from_millis(20));
        progress.update(Status { position: 950, steps: 900_050, ..Status::default() });
        assert!(progress.steps.per_second() <= 50.0 / 0.020, "{}", progress.steps.per_second());
        progress.finish();
    }
}
