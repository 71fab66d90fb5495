//! Completions for shells and the manual page, from the command line that a program has.
//!
//! `PROGRAM --print-manual man` prints the page, and `bash`, `zsh`, `fish`, `elvish` or `powershell` in its place prints
//! what that shell needs to complete the program's options. `cargo xtask man` writes them all into a folder.

use crate::exit::Exit;
use crate::terminal::{say, tell};
use clap::{Command, ValueEnum};
use clap_complete::Shell;
use clap_mangen::Man;
use std::ffi::OsString;

/// The option, which no help mentions.
pub const OPTION: &str = "--print-manual";

/// Prints what [`OPTION`] asks for, if that is what the process was started with; else the program goes on as ever.
pub fn printed(command: Command) -> Option<Exit> {
    let arguments: Vec<OsString> = std::env::args_os().skip(1).collect();
    let [option, what] = &arguments[..] else { return None };
    if option != OPTION {
        return None;
    }
    let text = what.to_str().and_then(|what| text(command, what));
    Some(if let Some(text) = text {
        say(text.trim_end());
        Exit::Done
    } else {
        tell(format_args!("{OPTION} needs man, bash, zsh, fish, elvish or powershell"));
        Exit::Failed
    })
}

fn text(command: Command, what: &str) -> Option<String> {
    if what == "man" {
        return page(command);
    }
    let shell = Shell::from_str(what, false).ok()?;
    let name = command.get_name().to_owned();
    let mut bytes = Vec::new();
    clap_complete::generate(shell, &mut without_hidden(&command), name, &mut bytes);
    let script = String::from_utf8(bytes).ok()?;
    Some(if shell == Shell::Fish { with_values(&script) } else { script })
}

/// The command as shells need it: the generator would offer hidden subcommands, too.
fn without_hidden(command: &Command) -> Command {
    // The builder wants words that live for ever; these few do, and the program ends soon.
    let word = |text: &str| -> &'static str { text.to_owned().leak() };
    let shown = command.get_subcommands().filter(|subcommand| !subcommand.is_hide_set());
    Command::new(word(command.get_name()))
        .version(word(command.get_version().unwrap_or_default()))
        .about(command.get_about().cloned().unwrap_or_default())
        .args(command.get_arguments().cloned())
        .subcommands(shown.cloned())
}

/// The generator's script for fish does not complete the value of an option before the subcommand: it takes the line for
/// wrong, because the value is not there yet. With anything in its place the line is right.
fn with_values(script: &str) -> String {
    let (parse, or_return) = (" -- $cmd 2>/dev/null", "\n    or return");
    let line = script.lines().find(|line| line.ends_with(parse)).unwrap_or_default();
    let again = format!("{line}\n    or {} -- $cmd value 2>/dev/null", line.trim().trim_end_matches(parse));
    script.replacen(&format!("{line}{or_return}"), &format!("{again}{or_return}"), 1)
}

/// One page for the program: its own sections, then one for each subcommand that help shows.
fn page(mut command: Command) -> Option<String> {
    // Names the subcommands by how they are called.
    command.build();
    let mut bytes = Vec::new();
    Man::new(command.clone()).render(&mut bytes).ok()?;
    let mut page = String::from_utf8(bytes).ok()?;
    for subcommand in command.get_subcommands().filter(|subcommand| !subcommand.is_hide_set()) {
        if subcommand.get_name() == "help" {
            continue;
        }
        let called = subcommand.get_bin_name().unwrap_or(subcommand.get_name()).to_owned();
        let man = Man::new(subcommand.clone());
        let mut bytes = Vec::new();
        man.render_synopsis_section(&mut bytes).ok()?;
        man.render_description_section(&mut bytes).ok()?;
        man.render_options_section(&mut bytes).ok()?;
        if subcommand.get_after_help().is_some() || subcommand.get_after_long_help().is_some() {
            man.render_extra_section(&mut bytes).ok()?;
        }
        // Its sections are parts of its own one.
        let parts = String::from_utf8(bytes).ok()?.replace(".SH ", ".SS ");
        page += &format!("\n.SH \"{}\"\n{parts}", called.to_uppercase());
    }
    Some(page)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Arg;

    fn command() -> Command {
        let drive =
            Command::new("drive").about("Drives").arg(Arg::new("speed").long("speed").help("How fast"));
        Command::new("robot")
            .about("A robot")
            .arg(Arg::new("name").long("name").help("What it is called"))
            .subcommand(drive.after_help("Examples: none"))
            .subcommand(Command::new("secret").hide(true).arg(Arg::new("trick").long("trick")))
    }

    #[test]
    fn the_page_has_every_option_that_help_shows() {
        let page = text(command(), "man").expect("a page");
        for part in
            [".TH robot 1", "\\-\\-name", ".SH \"ROBOT DRIVE\"", "\\-\\-speed", "How fast", "Examples"]
        {
            assert!(page.contains(part), "{part} is missing in {page}");
        }
        assert!(!page.contains("trick"), "{page}");
    }

    #[test]
    fn each_shell_learns_the_options() {
        for shell in Shell::value_variants() {
            let script = text(command(), &shell.to_string()).expect("a script");
            assert!(script.contains("speed") && script.contains("name"), "{shell}: {script}");
            assert!(!script.contains("secret"), "{shell} offers what is hidden: {script}");
        }
        let fish = text(command(), "fish").expect("a script");
        assert!(fish.contains("-- $cmd value 2>/dev/null\n    or return"), "{fish}");
        assert_eq!(text(command(), "csh"), None);
    }
}
