//! Parts of messages: numbers in short form, and suggestions for misspelled names.

/// Name of the option that continues a run. The command replaces the names of options by its own.
pub const RESTART: &str = "`Existing::Continue`";

/// Name of the option that replaces the files of a run.
pub const REPLACE: &str = "`Existing::Replace`";

/// Name of the option that sets the folder of a run.
pub const FOLDER: &str = "`Options::folder`";

/// Maximum length of the names that [`nearest`] compares, bytes.
const LONGEST_NAME: usize = 64;

/// Format a number for a message. Very large and very small numbers have an exponent.
pub fn format_number(value: f64) -> String {
    match value.abs() {
        0.0 | 1e-3..1e6 => value.to_string(),
        size if size.is_finite() => format!("{value:e}"),
        _ => value.to_string(),
    }
}

/// Return the entry of `known` that resembles `name` most; `None` if no entry is similar. Names longer than
/// `LONGEST_NAME` are not compared.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    known
        .into_iter()
        .filter(|candidate| name.len().max(candidate.len()) <= LONGEST_NAME)
        .map(|candidate| {
            let likeness = strsim::jaro_winkler(&name.to_lowercase(), &candidate.to_lowercase());
            (likeness, candidate)
        })
        .filter(|(likeness, _)| *likeness > 0.75)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}

/// Return the suggestion for an error about an unknown name: `; did you mean …? (known: …)`. Without a
/// similar name, the result is only the part in parentheses. If `known` is empty, this part is
/// `(none is defined)`.
pub fn suggestion<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    let mean = nearest(name, known.iter().copied())
        .map_or(String::new(), |near| format!("; did you mean `{near}`?"));
    if known.is_empty() {
        format!("{mean} (none is defined)")
    } else {
        format!("{mean} (known: {})", known.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_suggestion_names_the_nearest() {
        assert_eq!(
            suggestion("horizn", ["spacing", "horizon"]),
            "; did you mean `horizon`? (known: spacing, horizon)"
        );
        assert_eq!(suggestion("a", []), " (none is defined)");
    }
}
