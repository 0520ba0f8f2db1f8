//! The document of all commands and flags, made from their own definitions and held against its copy in `docs`.

use super::line::Line;
use clap::{Arg, Command, CommandFactory as _};
use std::{fmt::Write as _, path::Path};

const HEAD: &str = "# Commands\n\nEvery command and flag with its default, as `ovtigre COMMAND --help` explains them. This file is made from the program \
                    (`OVTIGRE_WRITE=1 cargo test --workspace --bin ovtigre reference`), and a test fails where it differs.\n";

/// A text on one line of a table.
fn cell(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|").replace('<', "\\<")
}

fn written(argument: &Arg) -> String {
    let values: Vec<String> =
        argument.get_value_names().unwrap_or_default().iter().map(ToString::to_string).collect();
    let takes = argument.get_action().takes_values();
    let value = if takes { values.join(" ") } else { String::new() };
    let short = argument.get_short().map(|short| format!("-{short}, ")).unwrap_or_default();
    match argument.get_long() {
        Some(long) => format!("`{short}--{long}{}{value}`", if takes { " " } else { "" }),
        None => format!("`{value}`"),
    }
}

/// What help says, apart from the default that it may name itself.
fn explained(argument: &Arg) -> (String, String) {
    let help = cell(&argument.get_help().map(ToString::to_string).unwrap_or_default());
    let Some((before, rest)) = help.split_once(" [default: ") else { return (help, String::new()) };
    let (default, after) = rest.split_once(']').unwrap_or((rest, ""));
    (format!("{before}{after}"), default.to_owned())
}

fn row(argument: &Arg) -> String {
    let (mut means, mut default) = explained(argument);
    if argument.get_action().takes_values() {
        let given: Vec<_> =
            argument.get_default_values().iter().map(|value| value.to_string_lossy()).collect();
        if !given.is_empty() {
            default = format!("`{}`", cell(&given.join(" ")));
        }
        let choices: Vec<String> =
            argument.get_possible_values().iter().map(|choice| format!("`{}`", choice.get_name())).collect();
        if !choices.is_empty() {
            write!(means, ": {}", choices.join(", ")).expect("a string takes all");
        }
    }
    format!("| {} | {means} | {default} |\n", written(argument).replace('|', "\\|"))
}

fn section(command: &Command, name: &str) -> String {
    let about = command.get_long_about().or(command.get_about()).map(ToString::to_string).unwrap_or_default();
    let usage = command.clone().render_usage().to_string();
    let usage = usage.strip_prefix("Usage: ").unwrap_or(&usage);
    let mut text = format!("\n## {name}\n\n{}\n\n```text\n{}\n```\n", cell(&about), usage.trim());
    let shown: Vec<&Arg> = (command.get_arguments())
        .filter(|argument| {
            !argument.is_hide_set() && !matches!(argument.get_id().as_str(), "help" | "version")
        })
        .collect();
    if !shown.is_empty() {
        text.push_str("\n| flag | means | default |\n| --- | --- | --- |\n");
        text.extend(shown.into_iter().map(row));
    }
    for inner in command.get_subcommands().filter(|inner| inner.get_name() != "help") {
        write!(text, "{}", section(inner, &format!("{name} {}", inner.get_name())))
            .expect("a string takes all");
    }
    text
}

#[test]
fn the_document_of_the_commands_is_what_the_program_says() {
    let mut line = Line::command();
    line.build();
    let text: String = (line.get_subcommands())
        .filter(|command| command.get_name() != "help")
        .map(|command| section(command, &format!("ovtigre {}", command.get_name())))
        .collect();
    let text = format!("{HEAD}{text}");
    let copy = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/COMMAND.md");
    if std::env::var_os("OVTIGRE_WRITE").is_some() {
        std::fs::write(&copy, &text).unwrap();
    }
    let kept = std::fs::read_to_string(&copy).unwrap_or_default();
    assert!(kept == text, "docs/COMMAND.md is not what the program says: write it with OVTIGRE_WRITE=1");
}
