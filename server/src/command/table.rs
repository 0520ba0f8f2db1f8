//! Tables for people.

use super::terminal;

/// Prints rows under a heading, columns as wide as their widest cell.
pub(crate) fn print<const N: usize>(heading: [&str; N], rows: &[[String; N]]) {
    for line in lines(heading, rows) {
        terminal::result(&line);
    }
}

/// Prints names and what they are, those that say something.
pub(crate) fn facts(facts: &[(&str, String)]) {
    let width = facts.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    for (name, fact) in facts.iter().filter(|(_, fact)| !fact.is_empty()) {
        terminal::result(&format!("{name:width$}  {fact}"));
    }
}

fn lines<const N: usize>(heading: [&str; N], rows: &[[String; N]]) -> Vec<String> {
    let width = |i: usize| {
        let cells = rows.iter().map(|row| row[i].chars().count());
        cells.chain([heading[i].chars().count()]).max().unwrap_or(0)
    };
    let widths: [usize; N] = std::array::from_fn(width);
    let line = |cells: [&str; N]| {
        let padded: Vec<String> = (0..N).map(|i| format!("{:1$}", cells[i], widths[i])).collect();
        padded.join("  ").trim_end().to_owned()
    };
    let body = rows.iter().map(|row| line(std::array::from_fn(|i| row[i].as_str())));
    std::iter::once(line(heading)).chain(body).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up() {
        let rows = [["a".to_owned(), "±1".to_owned()], ["long".to_owned(), String::new()]];
        assert_eq!(lines(["id", "error"], &rows), ["id    error", "a     ±1", "long"]);
    }
}
