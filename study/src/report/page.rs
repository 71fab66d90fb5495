//! The page: well-formed as XML too, so that any reader can check it.

use std::collections::BTreeSet;
use std::fmt::Write;

use super::gallery::Picture;
use super::grid::Grid;
use super::{pathbench, summary, tables};
use crate::analysis::Analysis;
use crate::cells::Cells;
use crate::figures::{Figure, Letters, escaped};
use crate::plan::Study;
use crate::provenance::Provenance;
use crate::rows::Tables;

const STYLE: &str = include_str!("style.css");

/// Everything that the page is made of.
pub(super) struct Content<'a> {
    pub(super) study: &'a Study,
    pub(super) tables: &'a Tables,
    pub(super) cells: &'a Cells,
    pub(super) analysis: &'a Analysis,
    pub(super) figures: &'a [Figure],
    pub(super) pictures: &'a [Picture],
    pub(super) provenance: &'a Provenance,
}

impl Content<'_> {
    /// The tables that have rows, in the order of the page.
    pub(super) fn grids(&self) -> Vec<Grid> {
        let Self { study, analysis, cells, .. } = self;
        let grids = [
            tables::headline(study, analysis),
            tables::methods(study, analysis),
            tables::non_inferiority(study, analysis),
            tables::ladder(study, analysis),
            tables::ablation(study, analysis),
            tables::paired(study, analysis),
            pathbench::grid(study, analysis),
            tables::runs(study, analysis),
            tables::missing(study, cells),
        ];
        grids.into_iter().filter(|grid| !grid.rows.is_empty()).collect()
    }

    /// The page with these tables.
    pub(super) fn html(&self, grids: &[Grid]) -> String {
        let title = escaped(&self.study.title);
        let mut html = format!(
            "<!DOCTYPE html>\n<html xmlns=\"http://www.w3.org/1999/xhtml\" lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>{title}</title>\n\
             <style>\n{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n"
        );
        self.opening(&mut html);
        let table = |html: &mut String, name: &str| {
            if let Some(grid) = grids.iter().find(|grid| grid.name == name) {
                section(html, grid.name, grid.title, &grid.note, &grid.html());
            }
        };
        table(&mut html, "headline");
        for figure in self.figures.iter().filter(|figure| figure.name == "primary-differences") {
            self::figure(&mut html, figure);
        }
        table(&mut html, "methods");
        for figure in self.figures.iter().filter(|figure| figure.name != "primary-differences") {
            self::figure(&mut html, figure);
        }
        for name in ["non-inferiority", "ladder", "ablation", "paired", "pathbench", "runs", "missing"] {
            table(&mut html, name);
        }
        if !self.pictures.is_empty() {
            let pictures: String = self.pictures.iter().map(Picture::html).collect();
            let body = format!("<div class=\"gallery\">\n{pictures}</div>\n");
            section(&mut html, "gallery", "Looked at", "Episodes won and lost, as they were drawn.", &body);
        }
        self.making(&mut html);
        html.push_str("</body>\n</html>\n");
        html
    }

    fn opening(&self, html: &mut String) {
        let Self { study, cells, analysis, .. } = self;
        put(html, "p", &study.inference);
        if !cells.gaps.is_empty() {
            let what = "<p class=\"warning\">These rows are not all that the study names: see \
                        <a href=\"#missing\">what is missing</a>. Answers marked as incomplete are no results.</p>\n";
            html.push_str(what);
        }
        let sentences = summary::sentences(study, analysis);
        if !sentences.is_empty() {
            html.push_str("<h2 id=\"short\">In short</h2>\n<ul>\n");
            sentences.iter().for_each(|sentence| put(html, "li", sentence));
            html.push_str("</ul>\n");
        }
    }

    /// How it was made: commands, commits, machines, seeds, files, and the study itself.
    fn making(&self, html: &mut String) {
        let Self { study, tables, provenance, cells, .. } = self;
        html.push_str("<h2 id=\"making\">How this was made</h2>\n<dl>\n");
        let mut told = |name: &str, value: &str| {
            put(html, "dt", name);
            put(html, "dd", value);
        };
        let list = |values: BTreeSet<&str>| values.into_iter().collect::<Vec<_>>().join("; ");
        told("this page", &format!("{} (commit {})", provenance.command, provenance.commit));
        told("judged on", &provenance.machine);
        let runs = || tables.runs.iter();
        let commits = list(runs().filter_map(|run| run.commit.as_deref()).collect());
        let machines = list(runs().filter_map(|run| run.machine.as_deref()).collect());
        let commands = list(runs().filter_map(|run| run.command.as_deref()).collect());
        for (name, values) in [("trained at", commits), ("trained on", machines), ("trained by", commands)] {
            if !values.is_empty() {
                told(name, &values);
            }
        }
        for method in study.methods.iter().filter(|method| method.is_learned()) {
            let seeds: Vec<String> = method.seeds.iter().map(u64::to_string).collect();
            told(&format!("seeds of {}", method.label), &seeds.join(", "));
        }
        told(
            "worlds",
            &format!(
                "{} of each family, split {}, disturbance {}: {}",
                study.worlds,
                study.split,
                study.disturbance,
                study.families.join(", ")
            ),
        );
        told(
            "intervals",
            &format!(
                "{:.0} %, {} resamples of seeds and worlds (seed {}); worlds are drawn once for all seeds and methods",
                100.0 * study.bootstrap.coverage,
                study.bootstrap.resamples,
                study.bootstrap.seed
            ),
        );
        for (reason, count) in &cells.left_out {
            told("rows left out", &format!("{count} of {reason}"));
        }
        let files = tables.files.iter().map(|(path, rows)| format!("{} ({rows} rows)", path.display()));
        told("files read", &files.collect::<Vec<_>>().join(", "));
        let unread: Vec<String> = tables.unread.iter().map(|path| path.display().to_string()).collect();
        if !unread.is_empty() {
            told("tables of other columns, not read", &unread.join(", "));
        }
        html.push_str("</dl>\n<details><summary>The study as it was described</summary>\n");
        put(html, "pre", &study.text);
        html.push_str("</details>\n");
    }
}

fn put(html: &mut String, element: &str, text: &str) {
    writeln!(html, "<{element}>{}</{element}>", escaped(text)).expect("a string takes everything");
}

fn section(html: &mut String, name: &str, title: &str, note: &str, body: &str) {
    writeln!(html, "<h2 id=\"{name}\">{}</h2>", escaped(title)).expect("a string takes everything");
    put(html, "p", note);
    html.push_str(body);
}

fn figure(html: &mut String, figure: &Figure) {
    writeln!(
        html,
        "<figure id=\"{}\">\n<h2>{}</h2>\n{}<figcaption>{}</figcaption>\n</figure>",
        figure.name,
        escaped(figure.title),
        figure.svg(Letters::Font),
        escaped(&figure.caption)
    )
    .expect("a string takes everything");
}
