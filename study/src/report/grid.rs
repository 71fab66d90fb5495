//! A table, for the page and for programs.

use std::fmt::Write;
use std::io;

use crate::analysis::estimate::Estimate;
use crate::figures::escaped;

/// Where there is nothing to say.
pub(super) const DASH: &str = "–";

/// A table.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    /// Name of its file and of its place in the page.
    pub(super) name: &'static str,
    /// Headline.
    pub(super) title: &'static str,
    /// What its columns mean.
    pub(super) note: String,
    /// Columns.
    pub(super) columns: Vec<String>,
    /// Rows, each as long as the columns.
    pub(super) rows: Vec<Vec<String>>,
}

impl Grid {
    /// An empty table.
    pub(super) fn new(name: &'static str, title: &'static str, note: &str, columns: &[&str]) -> Self {
        let columns = columns.iter().map(|&column| column.to_owned()).collect();
        Self { name, title, note: note.to_owned(), columns, rows: Vec::new() }
    }

    /// As elements of a page; what looks like a number stands to the right.
    pub(super) fn html(&self) -> String {
        let mut html = String::from("<div class=\"wide\"><table>\n<thead><tr>");
        for (index, column) in self.columns.iter().enumerate() {
            let mut cells = self.rows.iter().filter_map(|row| row.get(index)).filter(|cell| *cell != DASH);
            let class = if cells.all(|cell| is_number(cell)) { " class=\"number\"" } else { "" };
            write!(html, "<th scope=\"col\"{class}>{}</th>", escaped(column))
                .expect("a string takes everything");
        }
        html.push_str("</tr></thead>\n<tbody>\n");
        for row in &self.rows {
            html.push_str("<tr>");
            for cell in row {
                let class = if is_number(cell) || cell == DASH { " class=\"number\"" } else { "" };
                write!(html, "<td{class}>{}</td>", escaped(cell)).expect("a string takes everything");
            }
            html.push_str("</tr>\n");
        }
        html.push_str("</tbody></table></div>\n");
        html
    }

    /// As CSV.
    pub(super) fn csv(&self) -> io::Result<String> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(&self.columns)?;
        for row in &self.rows {
            writer.write_record(row)?;
        }
        let bytes = writer.into_inner().map_err(|error| io::Error::other(error.to_string()))?;
        String::from_utf8(bytes).map_err(io::Error::other)
    }
}

fn is_number(cell: &str) -> bool {
    let mut letters = cell.chars();
    letters.next().is_some_and(|first| first.is_ascii_digit() || "+-<".contains(first))
        && !letters.any(|letter| letter.is_ascii_alphabetic() && letter != 'e')
}

/// A share with its interval, in hundredths.
pub(super) fn percent(estimate: Estimate) -> String {
    let [value, low, high] = [estimate.value, estimate.interval.low, estimate.interval.high].map(hundredths);
    format!("{value} [{low}, {high}]")
}

/// A share in hundredths; what rounds to zero has no sign.
pub(super) fn hundredths(share: f64) -> String {
    let text = format!("{:.1}", 100.0 * share);
    if text == "-0.0" { "0.0".to_owned() } else { text }
}

/// A difference of shares with its interval, in hundredths with signs.
pub(super) fn points(estimate: Estimate) -> String {
    let signed = |share: f64| {
        let text = hundredths(share);
        if text.starts_with('-') || text == "0.0" { text } else { format!("+{text}") }
    };
    let [value, low, high] = [estimate.value, estimate.interval.low, estimate.interval.high].map(signed);
    format!("{value} [{low}, {high}]")
}

/// A number with its interval.
pub(super) fn plain(estimate: Estimate, digits: usize) -> String {
    let Estimate { value, interval } = estimate;
    format!("{value:.digits$} [{:.digits$}, {:.digits$}]", interval.low, interval.high)
}

/// A p-value; a dash where there is none.
pub(super) fn p_value(p: Option<f64>) -> String {
    match p {
        None => DASH.to_owned(),
        Some(p) if p < 0.001 => format!("{p:.1e}"),
        Some(p) => format!("{p:.3}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::Interval;

    #[test]
    fn numbers_are_short_and_have_their_signs() {
        let estimate = Estimate { value: 0.123_4, interval: Interval { low: -0.000_01, high: 0.5 } };
        assert_eq!(percent(estimate), "12.3 [0.0, 50.0]");
        assert_eq!(points(estimate), "+12.3 [0.0, +50.0]");
        let [none, small, large] = [None, Some(1.08e-5), Some(0.04)].map(p_value);
        assert_eq!([none, small, large], ["–", "1.1e-5", "0.040"]);
        assert!(is_number("+12.3 [0.0, +50.0]") && is_number("1.1e-5") && !is_number("10 of seeds"));
    }
}
