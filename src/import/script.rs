//! Commands and variables of an input script of LAMMPS.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use super::expression::{Dialect, rewrite};
use super::tree::{Content, MOST_NODES, Mistake, Node};
use crate::deck::Source;
use crate::expression::{Expression, Variable};

/// Maximum nesting depth of variables that refer to other variables, and of included files.
const DEEPEST: usize = 32;

/// Maximum length of a command after substitution, bytes.
const LONGEST: usize = 1 << 16;

/// A command with its arguments.
#[derive(Debug, Clone, PartialEq)]
pub struct Command {
    /// Words of the command, without quotes and with variables replaced.
    pub words: Vec<String>,
    /// Node under which the log stores the outcome of the command. If the command is from an included file,
    /// the line of the node is that of the `include` in the script.
    pub node: Node,
    /// File and line of a command of an included file, such as `supports.in:3`.
    origin: Option<String>,
}

impl Command {
    /// Return the name of the command.
    pub fn name(&self) -> &str {
        &self.words[0]
    }

    /// Return the name of the command. If the command is from an included file, file and line precede the
    /// name.
    pub fn key(&self) -> String {
        match &self.origin {
            Some(origin) => format!("{origin}: {}", self.name()),
            None => self.name().to_owned(),
        }
    }

    /// Return the arguments of the command.
    pub fn arguments(&self) -> Vec<&str> {
        self.words[1..].iter().map(String::as_str).collect()
    }
}

/// A LAMMPS input script.
#[derive(Debug, Default)]
pub struct Script {
    /// Commands in order, with those of included files.
    pub commands: Vec<Command>,
    /// Included files, relative to the working directory or absolute.
    pub files: Vec<PathBuf>,
}

/// Default time step of LAMMPS for each system of units, in the time unit of this system. The first entry
/// applies to scripts without the command `units`.
const DEFAULT_STEPS: [(&str, f64); 8] = [
    ("lj", 0.005),
    ("real", 1.0),
    ("metal", 0.001),
    ("si", 1e-8),
    ("cgs", 1e-8),
    ("electron", 0.001),
    ("micro", 2.0),
    ("nano", 0.00045),
];

/// Values that the variables and the time step have at one command of a script.
#[derive(Debug)]
pub struct Variables {
    /// Formula or value of each variable, by the name of the variable.
    values: HashMap<String, String>,
    /// Time step that the last command `timestep` has set, or the default of the units.
    pub step: f64,
    /// Whether a command `timestep` has set the time step.
    pub has_step: bool,
}

impl Default for Variables {
    fn default() -> Self {
        Self {
            values: HashMap::new(),
            step: DEFAULT_STEPS[0].1,
            has_step: false,
        }
    }
}

/// Test whether a text is a LAMMPS script with peridynamics.
pub fn is_script(text: &str) -> bool {
    text.lines().any(|line| {
        let mut words = line.split_whitespace();
        words.next() == Some("atom_style") && words.any(|word| word.starts_with("peri"))
    })
}

/// Split a script into commands. In each command, replace the variables and formulas after a `$` by the
/// values that they have at this command. Add the commands of included files, whose paths are relative to
/// `folder`.
///
/// # Errors
/// - If an included file cannot be read, or included files are nested too deeply.
/// - If a quote or bracket is not closed.
/// - If a variable is not defined.
/// - If a formula in `$(…)` is invalid or changes with time.
/// - If a time step is not a number.
/// - If the script or a line is too long.
pub fn parse(text: &str, folder: &Path) -> Result<Script, Mistake> {
    let mut script = Script::default();
    script.read(&mut Variables::default(), text, folder, None)?;
    Ok(script)
}

/// An included file.
struct Included<'f> {
    /// Name of the file, as in the command `include`.
    name: &'f str,
    /// Line of an `include` in the script: the one that includes this file, directly or through other files.
    line: usize,
    /// Nesting depth of the file; 1 if the script itself includes it.
    depth: usize,
}

/// Return a line without its comment, which begins with `#` outside quotes.
fn without_comment(row: &str) -> &str {
    let mut rest = row;
    while let Some(at) = rest.find(['#', '"', '\'']) {
        rest = &rest[at..];
        if rest.starts_with('#') {
            return &row[..row.len() - rest.len()];
        }
        let Some((_, after)) = quoted(rest) else {
            break;
        };
        rest = after;
    }
    row
}

/// Split a text that begins with a quote (`'`, `"` or `"""`) into the quoted text and the text after the
/// closing quote. Return `None` if there is no closing quote.
fn quoted(text: &str) -> Option<(&str, &str)> {
    let triple = "\"\"\"";
    let mark = if text.starts_with(triple) {
        triple
    } else {
        &text[..1]
    };
    text[mark.len()..].split_once(mark)
}

/// Split a line into words; a quoted text is one word.
fn words(text: &str) -> Result<Vec<String>, String> {
    let mut words = Vec::new();
    let mut rest = text.trim_start();
    while let Some(first) = rest.chars().next() {
        if first == '"' || first == '\'' {
            let (word, after) = quoted(rest).ok_or("a quote is not closed")?;
            words.push(word.to_owned());
            rest = after.trim_start();
        } else {
            let end = rest.find(char::is_whitespace).unwrap_or(rest.len());
            words.push(rest[..end].to_owned());
            rest = rest[end..].trim_start();
        }
    }
    Ok(words)
}

impl Script {
    /// Add the commands of a text: of the included file `included`, or of the script itself if `included` is
    /// `None`. The line in `Err` is a line of this text.
    fn read(
        &mut self,
        variables: &mut Variables,
        text: &str,
        folder: &Path,
        included: Option<&Included>,
    ) -> Result<(), Mistake> {
        let mut pending: Option<(usize, String)> = None;
        for (line, row) in (1..).zip(text.lines()) {
            let row = without_comment(row);
            let (start, mut joined) = pending.take().unwrap_or((line, String::new()));
            joined.push_str(row.trim_end());
            if let Some(continued) = joined.strip_suffix('&') {
                pending = Some((start, format!("{continued} ")));
                continue;
            }
            self.command(variables, start, &joined, folder, included)?;
        }
        match pending {
            Some((start, joined)) => self.command(variables, start, &joined, folder, included),
            None => Ok(()),
        }
    }

    /// Add the commands of the included file `name`. `line` is the line of `include` in the text that
    /// contains it; `included` is the included file with this text, `None` for the script.
    fn include(
        &mut self,
        variables: &mut Variables,
        line: usize,
        name: &str,
        folder: &Path,
        included: Option<&Included>,
    ) -> Result<(), Mistake> {
        let mistake = |message: String| (line, message);
        let depth = 1 + included.map_or(0, |included| included.depth);
        if depth > DEEPEST {
            let message = format!("include: files are included more than {DEEPEST} deep");
            return Err(mistake(message));
        }
        let path = folder.join(name);
        let source = Source::read(&path);
        let source = source.map_err(|error| mistake(format!("include: {}", error.message)))?;
        self.files.push(path);
        let inner = Included {
            name,
            line: included.map_or(line, |included| included.line),
            depth,
        };
        self.read(variables, &source.text, folder, Some(&inner))
            .map_err(|(line, message)| mistake(format!("{name}:{line}: {message}")))
    }

    /// Add the command of a line; a blank line adds none.
    fn command(
        &mut self,
        variables: &mut Variables,
        line: usize,
        text: &str,
        folder: &Path,
        included: Option<&Included>,
    ) -> Result<(), Mistake> {
        let mistake = |message: String| (line, message);
        let text = variables.substitute(text).map_err(mistake)?;
        let words = words(&text).map_err(mistake)?;
        if words.is_empty() {
            return Ok(());
        }
        if self.commands.len() >= MOST_NODES {
            return Err((line, format!("has more than {MOST_NODES} commands")));
        }
        // The node holds the arguments only: the name of the command becomes the key of the node in the tree.
        let node = Node {
            id: self.commands.len() + 1,
            line: included.map_or(line, |included| included.line),
            content: Content::Text(words[1..].join(" ")),
        };
        let origin = included.map(|included| format!("{}:{line}", included.name));
        let command = Command {
            words,
            node,
            origin,
        };
        variables.read(&command).map_err(mistake)?;
        self.commands.push(command.clone());
        match &command.words[..] {
            [name, file] if name == "include" => {
                self.include(variables, line, file, folder, included)
            }
            _ => Ok(()),
        }
    }
}

impl Variables {
    /// Apply the definition of a variable or of the time step.
    ///
    /// # Errors
    /// If the time step is not a number.
    pub fn read(&mut self, command: &Command) -> Result<(), String> {
        let words = &command.words;
        match (command.name(), words.len()) {
            ("units", 2) => {
                let mut units = DEFAULT_STEPS.iter();
                if let Some((_, step)) = units.find(|(name, _)| *name == words[1]) {
                    self.step = *step;
                    self.has_step = false;
                }
            }
            ("timestep", 2) => {
                self.step = self.number(&words[1])?;
                self.has_step = true;
            }
            ("variable", 4..) => {
                let style = words[2].as_str();
                let value = match style {
                    "equal" | "internal" => Some(words[3..].join(" ")),
                    "index" | "string" | "getenv" | "loop" | "world" => Some(words[3].clone()),
                    _ => None,
                };
                // An `index` variable that is already defined keeps its value.
                let keeps = style == "index" && self.values.contains_key(&words[1]);
                if let (Some(value), false) = (value, keeps) {
                    self.values.insert(words[1].clone(), value);
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Replace `$x`, `${name}` and `$(formula)` outside quotes.
    fn substitute(&self, text: &str) -> Result<String, String> {
        let mut result = String::new();
        let mut rest = text;
        while let Some(at) = rest.find(['$', '"', '\'']) {
            if !rest[at..].starts_with('$') {
                // After a quote that is not closed, such as an apostrophe within a word, nothing is replaced.
                let after = quoted(&rest[at..]).map_or("", |(_, after)| after);
                let (kept, after) = rest.split_at(rest.len() - after.len());
                result.push_str(kept);
                rest = after;
                continue;
            }
            result.push_str(&rest[..at]);
            rest = &rest[at + 1..];
            let value = if let Some(inner) = rest.strip_prefix('{') {
                let end = inner.find('}').ok_or("`${` is not closed")?;
                rest = &inner[end + 1..];
                self.value(&inner[..end])?
            } else if rest.starts_with('(') {
                let mut depth = 0_usize;
                let end = rest.char_indices().find(|(_, c)| {
                    match c {
                        '(' => depth += 1,
                        ')' => depth -= 1,
                        _ => {}
                    }
                    depth == 0
                });
                let (end, _) = end.ok_or("`$(` is not closed")?;
                let formula = &rest[1..end];
                rest = &rest[end + 1..];
                // A number format may follow a colon.
                let formula = formula.split(":%").next().unwrap_or(formula);
                self.constant(formula)?
            } else {
                let Some(name) = rest.chars().next().filter(|c| c.is_alphanumeric()) else {
                    return Err("`$` without the name of a variable".to_owned());
                };
                rest = &rest[name.len_utf8()..];
                self.value(&name.to_string())?
            };
            result.push_str(&value);
            if result.len() > LONGEST {
                return Err("the line is too long".to_owned());
            }
        }
        result.push_str(rest);
        Ok(result)
    }

    /// Return the value of a variable as text: the computed number if the text is a constant
    /// formula, otherwise the unchanged text.
    fn value(&self, name: &str) -> Result<String, String> {
        let text = self.values.get(name);
        let text = text.ok_or_else(|| format!("the variable `{name}` is not defined"))?;
        Ok(match self.constant(text) {
            Ok(value) => value,
            Err(_) => text.clone(),
        })
    }

    /// Evaluate a formula; a formula that changes with time is an error.
    fn constant(&self, formula: &str) -> Result<String, String> {
        if formula.trim().parse::<f64>().is_ok() {
            return Ok(formula.trim().to_owned());
        }
        let text = self.formula(formula, 0)?;
        let expression = Expression::of(&text).map_err(|error| error.message)?;
        let value = expression.as_constant();
        let value = value.ok_or_else(|| format!("`{formula}` changes with time"))?;
        Ok(format!("{value:?}"))
    }

    /// Return a number: a literal, or the constant value of a variable `v_name`.
    ///
    /// # Errors
    /// If the word is neither a finite number nor the name of a constant variable.
    pub fn number(&self, word: &str) -> Result<f64, String> {
        let number = word.parse::<f64>().ok().or_else(|| {
            let name = word.strip_prefix("v_")?;
            self.constant(self.values.get(name)?).ok()?.parse().ok()
        });
        let number = number.filter(|number| number.is_finite());
        number.ok_or_else(|| {
            format!(
                "must be a number, is `{}`",
                crate::error::excerpt(word).trim_matches('`')
            )
        })
    }

    /// Return `word` unchanged if it is a number. If `word` is a variable `v_name`, return the formula of the
    /// variable as an expression of time.
    ///
    /// # Errors
    /// If the variable is unknown, or its formula cannot be translated.
    pub fn of_time(&self, word: &str) -> Result<String, String> {
        let Some(name) = word.strip_prefix("v_") else {
            self.number(word)?;
            return Ok(word.to_owned());
        };
        let formula = self.values.get(name);
        let formula = formula.ok_or_else(|| format!("the variable `{name}` is not defined"))?;
        self.formula(formula, 0)
    }

    /// Translate a formula to an expression of time.
    fn formula(&self, formula: &str, depth: usize) -> Result<String, String> {
        if depth > DEEPEST {
            return Err("the variables are too deep, or use themselves".to_owned());
        }
        let step = self.step;
        let failed = std::cell::RefCell::new(None);
        let names = |name: &str| match name {
            "PI" => Some("pi".to_owned()),
            "dt" => Some(format!("{step:?}")),
            "time" => Some("t".to_owned()),
            "step" | "elapsed" | "elaplong" => Some(format!("(t/{step:?})")),
            name => {
                let known = self.values.get(name.strip_prefix("v_")?)?;
                match self.formula(known, depth + 1) {
                    Ok(text) => Some(match text.parse::<f64>() {
                        Ok(value) if value >= 0.0 => text,
                        _ => format!("({text})"),
                    }),
                    Err(message) => {
                        *failed.borrow_mut() = Some(message);
                        None
                    }
                }
            }
        };
        let result = rewrite(formula, Dialect::Lammps, &names, &[Variable::T]);
        match failed.into_inner() {
            Some(message) => Err(message),
            None => result,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Apply all commands and return the variables.
    fn behind(script: &Script) -> Variables {
        let mut variables = Variables::default();
        for command in &script.commands {
            variables.read(command).unwrap();
        }
        variables
    }

    #[test]
    fn commands_are_joined_and_variables_replaced() {
        let text = "units si # metres\nvariable a equal 2*PI\nvariable n index 7\n\
                    fix 1 all indent 1e17 sphere 0 &\n  ${a} $n v_y # to here\n\
                    timestep 1e-7\nvariable y0 equal 0.5\nvariable y equal \"v_y0 - step*dt*100\"\n\
                    fix 2 all print 9 \"$(step)\"\nrun $(10*v_n)\n";
        let script = parse(text, "".as_ref()).unwrap();
        let names: Vec<&str> = script.commands.iter().map(Command::name).collect();
        assert_eq!(
            names,
            [
                "units", "variable", "variable", "fix", "timestep", "variable", "variable", "fix",
                "run"
            ]
        );
        let fix = &script.commands[3];
        assert_eq!(fix.node.line, 4);
        assert_eq!(fix.words[6..], ["0", "6.283185307179586", "7", "v_y"]);
        let variables = behind(&script);
        assert_eq!(variables.of_time("v_y").unwrap(), "0.5-t*100");
        assert_eq!(script.commands[8].words[1], "70.0");
        // `step*dt` is the time only if no other operator binds tighter.
        for (formula, expected) in [
            ("dt * elapsed", "t"),
            ("1-step*dt^2", "1-(t/1e-7)*1e-7^2"),
            ("1/step*dt", "1/(t/1e-7)*1e-7"),
        ] {
            assert_eq!(variables.formula(formula, 0).unwrap(), expected);
        }
        assert_eq!(variables.step, 1e-7);
    }

    #[test]
    fn quotes_may_be_apostrophes_or_triple() {
        for (text, expected) in [
            ("print it's $x", &["print", "it's", "$x"][..]),
            (
                "print \"\"\"a \"b # $x\" it's\"\"\" c # d",
                &["print", "a \"b # $x\" it's", "c"],
            ),
            ("print \"\" 'a # b' # c", &["print", "", "a # b"]),
        ] {
            let script = parse(text, "".as_ref()).unwrap();
            assert_eq!(script.commands[0].words, expected, "{text}");
        }
    }

    #[test]
    fn mistakes_have_a_line() {
        for (text, line, message) in [
            ("units si\nrun ${n}\n", 2, "the variable `n` is not defined"),
            ("fix 1 all print \"a\nrun 1\n", 1, "a quote is not closed"),
            ("run ${n\n", 1, "`${` is not closed"),
            ("timestep x\n", 1, "must be a number, is `x`"),
            ("print \"\"\"a\" b\"\n", 1, "a quote is not closed"),
        ] {
            assert_eq!(
                parse(text, "".as_ref()).unwrap_err(),
                (line, message.to_owned()),
                "{text}"
            );
        }
        let text = "timestep 1\nvariable a equal v_b\nvariable b equal v_a\n";
        let variables = behind(&parse(text, "".as_ref()).unwrap());
        let message = "the variables are too deep, or use themselves";
        assert_eq!(variables.of_time("v_a"), Err(message.to_owned()));
    }
}
