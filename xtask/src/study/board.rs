//! The table of a study under way: a row a method, a cell a training seed. On a terminal it is drawn anew as it changes; elsewhere
//! a line says what has changed.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::io::{IsTerminal, stdout};
use std::mem::discriminant;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::shell::say;

/// Width of a cell.
const CELL: usize = 9;
/// What cells mean.
const LEGEND: &str = "- waits   37 % is trained   eval 40 % is driven
5:02 (min:s) was trained in, and driven (* its gate was missed)   failed left no policy";

/// How far a method with a seed is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Cell {
    /// Not begun.
    Waiting,
    /// Trains; how many percent are done.
    Training(u8),
    /// Drives; how many percent are done.
    Evaluating(u8),
    /// Was driven.
    Done {
        /// Time to train, s, if it was trained.
        train_s: Option<f64>,
        /// Whether it missed the trainer's gate.
        is_missed: bool,
    },
    /// The training run left no policy.
    Failed,
    /// A program failed.
    Error,
}

impl Cell {
    fn is_over(self) -> bool {
        matches!(self, Self::Done { .. } | Self::Failed | Self::Error)
    }

    /// In a table.
    fn short(self) -> String {
        match self {
            Self::Waiting => "-".to_owned(),
            Self::Training(percent) => format!("{percent} %"),
            Self::Evaluating(percent) => format!("eval {percent} %"),
            Self::Done { train_s, is_missed } => {
                let mark = if is_missed { "*" } else { "" };
                train_s.map_or_else(|| "done".to_owned(), minutes) + mark
            }
            Self::Failed => "failed".to_owned(),
            Self::Error => "error".to_owned(),
        }
    }

    /// In a line.
    fn long(self) -> String {
        match self {
            Self::Waiting => "waiting".to_owned(),
            Self::Training(percent) => format!("training {percent} %"),
            Self::Evaluating(percent) => format!("evaluating {percent} %"),
            Self::Done { train_s, is_missed } => {
                let trained = train_s.map(|seconds| format!(", trained in {}", minutes(seconds)));
                let missed = if is_missed { ", its gate missed" } else { "" };
                format!("done{}{missed}", trained.unwrap_or_default())
            }
            Self::Failed => "failed: the run left no policy".to_owned(),
            Self::Error => "error".to_owned(),
        }
    }

    /// Whether the way from another to this one is worth a line.
    fn is_news_after(self, before: Self) -> bool {
        match (before, self) {
            (Self::Training(before), Self::Training(now))
            | (Self::Evaluating(before), Self::Evaluating(now)) => now / 25 > before / 25,
            _ => discriminant(&before) != discriminant(&self),
        }
    }
}

/// Of a time in seconds.
fn minutes(seconds: f64) -> String {
    let seconds = Duration::from_secs_f64(seconds.max(0.0)).as_secs();
    format!("{}:{:02}", seconds / 60, seconds % 60)
}

/// A method.
struct Row {
    name: String,
    cells: Vec<(Option<u64>, Cell)>,
}

/// The table.
pub(super) struct Board {
    rows: Mutex<Vec<Row>>,
    /// Nothing where there is no terminal.
    bar: Option<ProgressBar>,
    begun: Instant,
}

impl Board {
    /// A table of methods by name, each with its seeds; none of what learns nothing.
    pub(super) fn new(methods: Vec<(String, Vec<Option<u64>>)>) -> Self {
        let row = |(name, seeds): (String, Vec<Option<u64>>)| Row {
            name,
            cells: seeds.into_iter().map(|seed| (seed, Cell::Waiting)).collect(),
        };
        let bar = stdout().is_terminal().then(|| {
            let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stdout_with_hz(4));
            bar.with_style(
                ProgressStyle::with_template("{msg}").unwrap_or_else(|_| ProgressStyle::default_bar()),
            )
        });
        Self { rows: Mutex::new(methods.into_iter().map(row).collect()), bar, begun: Instant::now() }
    }

    /// Tells how far a method with a seed is.
    pub(super) fn set(&self, name: &str, seed: Option<u64>, cell: Cell) {
        let mut rows = self.rows();
        let cells = rows.iter_mut().filter(|row| row.name == name).flat_map(|row| &mut row.cells);
        let Some((_, own)) = cells.into_iter().find(|(of, _)| *of == seed) else { return };
        let before = std::mem::replace(own, cell);
        match &self.bar {
            Some(bar) => bar.set_message(table(&rows, self.begun.elapsed())),
            None if cell.is_news_after(before) => say(&format!("{}: {}", title(name, seed), cell.long())),
            None => {}
        }
    }

    /// Says something above the table.
    pub(super) fn say(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.println(format!("xtask: {text}")),
            None => say(text),
        }
    }

    /// Leaves the table as it is.
    pub(super) fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.abandon_with_message(table(&self.rows(), self.begun.elapsed()));
        }
    }

    fn rows(&self) -> MutexGuard<'_, Vec<Row>> {
        self.rows.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A method with a seed, in a line.
pub(super) fn title(name: &str, seed: Option<u64>) -> String {
    seed.map_or_else(|| name.to_owned(), |seed| format!("{name}, seed {seed}"))
}

fn table(rows: &[Row], elapsed: Duration) -> String {
    let seeds: BTreeSet<u64> = rows.iter().flat_map(|row| &row.cells).filter_map(|(seed, _)| *seed).collect();
    let wide = rows.iter().map(|row| row.name.len()).max().unwrap_or(0).max("method".len());
    let mut text = format!("{:wide$}", "method");
    for seed in &seeds {
        let _ = write!(text, "  {:>CELL$}", format!("seed {seed}"));
    }
    for row in rows {
        let _ = write!(text, "\n{:wide$}", row.name);
        let of = |wanted: Option<u64>| row.cells.iter().find(|(seed, _)| *seed == wanted);
        // What has no seed stands in the first column.
        let columns: Vec<_> = match of(None) {
            Some(cell) => vec![Some(cell)],
            None => seeds.iter().map(|seed| of(Some(*seed))).collect(),
        };
        for cell in columns {
            let _ = write!(text, "  {:>CELL$}", cell.map_or_else(String::new, |(_, cell)| cell.short()));
        }
    }
    let cells = || rows.iter().flat_map(|row| &row.cells);
    let over = cells().filter(|(_, cell)| cell.is_over()).count();
    let _ = write!(
        text,
        "\n{over} of {} done after {} (min:s)\n{LEGEND}",
        cells().count(),
        minutes(elapsed.as_secs_f64())
    );
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn board() -> Board {
        let seeds = |seeds: &[u64]| seeds.iter().map(|seed| Some(*seed)).collect();
        Board::new(vec![
            ("hybrid".to_owned(), seeds(&[1, 2, 3])),
            ("no_mirror".to_owned(), seeds(&[2, 10])),
            ("astar".to_owned(), vec![None]),
        ])
    }

    #[test]
    fn the_table_has_a_row_a_method_and_a_column_a_seed() {
        let board = board();
        board.set("hybrid", Some(1), Cell::Done { train_s: Some(302.4), is_missed: false });
        board.set("hybrid", Some(2), Cell::Training(37));
        board.set("no_mirror", Some(2), Cell::Done { train_s: Some(61.0), is_missed: true });
        board.set("no_mirror", Some(10), Cell::Failed);
        board.set("astar", None, Cell::Evaluating(40));
        board.set("nobody", None, Cell::Error);
        let shown = table(&board.rows(), Duration::from_secs(754));
        let lines: Vec<String> =
            shown.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" ")).collect();
        assert_eq!(
            lines[..5],
            [
                "method seed 1 seed 2 seed 3 seed 10",
                "hybrid 5:02 37 % -",
                "no_mirror 1:01* failed",
                "astar eval 40 %",
                "3 of 6 done after 12:34 (min:s)",
            ]
        );
        let ends = |line: usize, text: &str| {
            shown.lines().nth(line).and_then(|line| line.find(text)).map(|at| at + text.len())
        };
        assert_eq!(ends(2, "1:01*"), ends(0, "seed 2"), "in the column of its seed: {shown}");
        assert_eq!(ends(2, "failed"), ends(0, "seed 10"), "{shown}");
    }

    #[test]
    fn lines_come_with_news_only() {
        let done = Cell::Done { train_s: None, is_missed: false };
        assert!(
            Cell::Training(0).is_news_after(Cell::Waiting)
                && Cell::Evaluating(0).is_news_after(Cell::Training(9))
        );
        assert!(
            Cell::Training(50).is_news_after(Cell::Training(49)) && done.is_news_after(Cell::Evaluating(99))
        );
        assert!(!Cell::Training(49).is_news_after(Cell::Training(26)) && !done.is_news_after(done));
        assert_eq!(
            Cell::Done { train_s: Some(60.0), is_missed: true }.long(),
            "done, trained in 1:00, its gate missed"
        );
    }
}
