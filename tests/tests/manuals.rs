//! Manual pages and completions of runtime and simulator; the trainer's test is its own.

mod support;

use std::collections::BTreeSet;
use support::Stage;
use support::programs::program;

/// What a program prints.
fn printed(name: &str, arguments: &[&str]) -> String {
    let mut command = program(name, &Stage::new(), &[]);
    command = std::process::Command::new(command.get_program());
    let output = command.args(arguments).output().expect("it starts");
    assert!(output.status.success(), "{name} {arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// The long options in the help of a program and of these subcommands.
fn options(name: &str, subcommands: &[&str]) -> BTreeSet<String> {
    let helps = subcommands.iter().map(|subcommand| printed(name, &[subcommand, "--help"]));
    let helps: Vec<_> = helps.chain([printed(name, &["--help"])]).collect();
    let named = |line: &str| {
        let (_, rest) = line.trim_start().strip_prefix('-').map(|_| line)?.split_once("--")?;
        let option: String =
            rest.chars().take_while(|letter| letter.is_ascii_lowercase() || *letter == '-').collect();
        Some(option)
    };
    helps.iter().flat_map(|help| help.lines().filter_map(named)).collect()
}

#[test]
fn the_manual_page_names_every_option() {
    for (name, subcommands) in [("runtime", &["run", "check", "bench"][..]), ("simulator", &["import"])] {
        let page = printed(name, &["--print-manual", "man"]).replace('\\', "");
        assert!(page.contains(&format!(".TH {name} 1")), "{page}");
        let options = options(name, subcommands);
        assert!(options.len() > 10, "{options:?}");
        for option in options {
            assert!(page.contains(&format!("--{option}")), "--{option} is missing in the page of {name}");
        }
        assert!(!page.contains("loop-peer"), "what is hidden stays so");
    }
}

#[test]
fn each_shell_can_complete() {
    for name in ["runtime", "simulator"] {
        for (shell, part) in [("bash", "complete -F"), ("zsh", "#compdef"), ("fish", "complete -c")] {
            let script = printed(name, &["--print-manual", shell]);
            assert!(script.contains(part) && script.contains("report"), "{name} {shell}: {script}");
        }
    }
    let mut command = program("runtime", &Stage::new(), &[]);
    command = std::process::Command::new(command.get_program());
    let output = command.args(["--print-manual", "csh"]).output().expect("it starts");
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("bash, zsh, fish"));
}

#[test]
fn bash_accepts_the_script() {
    for name in ["runtime", "simulator"] {
        let script = printed(name, &["--print-manual", "bash"]);
        let mut bash = std::process::Command::new("bash");
        let output = bash.args(["-n", "-c", &script]).output().expect("bash starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
}
