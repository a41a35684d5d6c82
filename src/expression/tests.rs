//! Tests of the expression language.

use super::{Expression, ExpressionError, Variable};
use proptest::prelude::*;

const ALL: [Variable; 4] = [Variable::X, Variable::Y, Variable::Z, Variable::T];

/// Parse an expression with the parameters `dx` = 0.5 and `fo` = 3; all variables are allowed.
fn parse(text: &str) -> Result<Expression, ExpressionError> {
    let parameters = |name: &str| match name {
        "dx" => Some(0.5),
        "fo" => Some(3.0),
        _ => None,
    };
    Expression::parse(text, &parameters, &["dx", "fo", "later"], &ALL)
}

/// Evaluate at x = 2, y = 3, z = 5, t = 7.
fn value(text: &str) -> f64 {
    parse(text)
        .unwrap_or_else(|error| panic!("{text}: {error}"))
        .evaluate([2.0, 3.0, 5.0], 7.0)
}

/// Test whether two values have the same bits, or both are NaN.
fn same(left: f64, right: f64) -> bool {
    left.to_bits() == right.to_bits() || (left.is_nan() && right.is_nan())
}

#[test]
fn operators_bind_as_documented() {
    for (text, expected) in [
        ("1 + 2 * 3", 7.0),
        ("(1 + 2) * 3", 9.0),
        ("10 - 4 - 3", 3.0),
        ("10 - (4 - 3)", 9.0),
        ("24 / 4 / 2", 3.0),
        ("2 * 6 / 3 * 2", 8.0),
        ("2^3^2", 512.0),
        ("(2^3)^2", 64.0),
        ("-x^2", -4.0),
        ("(-x)^2", 4.0),
        ("2^-1", 0.5),
        ("2^-x^2", 1.0 / 16.0),
        ("2^-1*3", 1.5),
        ("2*-x", -4.0),
        ("-x*y", -6.0),
        ("1 - -1", 2.0),
        ("--x", 2.0),
        ("-+-x", 2.0),
        ("+x - +y", -1.0),
        ("!x", 0.0),
        ("!0", 1.0),
        ("!!x", 1.0),
        ("!x^0", 0.0),
        ("!0 + 1", 2.0),
        ("1 + 1 < 3", 1.0),
        ("3 > 1 + 1", 1.0),
        ("x < y && y < z", 1.0),
        ("x < y and y > z", 0.0),
        ("1 || 0 && 0", 1.0),
        ("(1 || 0) && 0", 0.0),
        ("1 or 0 and 0", 1.0),
        ("not 0 && not 0", 1.0),
        ("!(x < 1)", 1.0),
        ("(!x) < 1", 1.0),
        ("1 == !0", 1.0),
        ("(1 < 2) < 3", 1.0),
    ] {
        assert_eq!(value(text), expected, "{text}");
    }
}

#[test]
fn numbers_names_and_functions_have_their_values() {
    for (text, expected) in [
        ("1", 1.0),
        ("1.", 1.0),
        (".5", 0.5),
        ("1e-3", 1e-3),
        ("2.5E+6", 2.5e6),
        ("x + 10*y + 100*z + 1000*t", 7532.0),
        ("fo * dx", 1.5),
        ("pi", std::f64::consts::PI),
        ("2 <= 2", 1.0),
        ("2 >= 3", 0.0),
        ("2 != 3", 1.0),
        ("2 == 3", 0.0),
        ("atan2(1, -1)", 0.75 * std::f64::consts::PI),
        ("log(exp(2))", 2.0),
        ("sin(x)", 2f64.sin()),
        ("cos(x)", 2f64.cos()),
        ("tan(x)", 2f64.tan()),
        ("asin(0.5)", 0.5f64.asin()),
        ("acos(0.5)", 0.5f64.acos()),
        ("atan(x)", 2f64.atan()),
        ("sinh(x)", 2f64.sinh()),
        ("cosh(x)", 2f64.cosh()),
        ("tanh(x)", 2f64.tanh()),
        ("sqrt(x)", 2f64.sqrt()),
        ("log10(1000)", 3.0),
        ("hypot(3, 4)", 5.0),
        ("abs(-x)", 2.0),
        ("floor(-0.5) + 10*ceil(0.5)", 9.0),
        ("sign(-3) + 10*sign(0) + 100*sign(2)", 99.0),
        ("min(3, x, 4)", 2.0),
        ("max(3, x, 4, 1)", 4.0),
        ("min(0/0, 1)", f64::NAN),
        ("max(1, 0/0)", f64::NAN),
        ("if(x < y, 1, 0/0)", 1.0),
        ("if(x > y, 1, 4)", 4.0),
        ("if(0/0, 1, 2)", f64::NAN),
        ("!(0/0)", f64::NAN),
        ("0/0 && 1", f64::NAN),
        ("0/0 && 0", 0.0),
        ("0 && 0/0", 0.0),
        ("0/0 || 0", f64::NAN),
        ("0/0 || 1", 1.0),
        ("2 || 0/0", 1.0),
        ("0/0 < 1", 0.0),
        ("0/0 != 1", 1.0),
        ("step(0/0)", f64::NAN),
        ("step(-1e-9) + 10*step(0) + 100*step(1)", 110.0),
        ("ramp(1, 2, 4)", 0.0),
        ("ramp(2, 2, 4)", 0.0),
        ("ramp(2.5, 2, 4)", 0.25),
        ("ramp(4, 2, 4)", 1.0),
        ("ramp(t, 2, 4)", 1.0),
        ("ramp(2, 2, 2)", 1.0),
        ("ramp(1.9, 2, 2)", 0.0),
        ("ramp(1, x, 0*x)", 1.0),
        ("clamp(x, 3, 4)", 3.0),
        ("clamp(9, 3, 4)", 4.0),
        ("clamp(3.5, 3, 4)", 3.5),
        ("0.1^2", 0.1 * 0.1),
        ("0.1^x", 0.1 * 0.1),
        ("x^0.5", 2f64.powf(0.5)),
        ("0^0", 1.0),
        ("(-2)^3", -8.0),
        ("(-2)^0.5", f64::NAN),
        ("1\n +\t2", 3.0),
    ] {
        let actual = value(text);
        assert!(same(actual, expected), "{text}: {actual}, not {expected}");
    }
}

#[test]
fn errors_say_what_is_wrong_and_where() {
    for (text, start, end, message) in [
        ("", 0, 0, "the expression is empty"),
        (" ", 0, 1, "the expression is empty"),
        ("1 +", 3, 3, "unexpected end: expected a value after `+`"),
        ("1 + ", 4, 4, "unexpected end: expected a value after `+`"),
        ("* 2", 0, 1, "expected a value at the start, found `*`"),
        ("1 + * 2", 4, 5, "expected a value after `+`, found `*`"),
        ("()", 1, 2, "expected a value after `(`, found `)`"),
        ("min(1, )", 7, 8, "expected a value after `,`, found `)`"),
        (
            "2 * (x + 1",
            4,
            5,
            "unbalanced parenthesis: this `(` is never closed",
        ),
        (
            "sin(x",
            3,
            4,
            "unbalanced parenthesis: this `(` is never closed",
        ),
        (
            "x + 1)",
            5,
            6,
            "unbalanced parenthesis: this `)` closes nothing",
        ),
        (
            "x, y",
            1,
            2,
            "unexpected `,`: it only separates the arguments of a function",
        ),
        (
            "(x, y)",
            2,
            3,
            "unexpected `,`: it only separates the arguments of a function",
        ),
        (
            "2x",
            1,
            2,
            "expected an operator before `x`; to multiply, write `* x`",
        ),
        (
            "sin(x y)",
            6,
            7,
            "expected an operator before `y`; to multiply, write `* y`",
        ),
        (
            "1.2.3",
            3,
            5,
            "expected an operator before `.3`; to multiply, write `* .3`",
        ),
        (
            "1 + foo",
            4,
            7,
            "unknown name `foo`; did you mean `fo`? known here: x, y, z, t, dx, fo, later, pi",
        ),
        (
            "1 + Dx",
            4,
            6,
            "unknown name `Dx`; did you mean `dx`? known here: x, y, z, t, dx, fo, later, pi",
        ),
        (
            "q",
            0,
            1,
            "unknown name `q`; known here: x, y, z, t, dx, fo, later, pi",
        ),
        (
            "later",
            0,
            5,
            "`later` has no value that could be used here",
        ),
        (
            "e^x",
            0,
            1,
            "unknown name `e`; for Euler's number, write `exp(1)`",
        ),
        ("sin + 1", 0, 3, "`sin` is a function: write `sin(…)`"),
        (
            "x(y + 1)",
            0,
            1,
            "`x` is not a function; to multiply, write `x * (…)`",
        ),
        (
            "dx(y + 1)",
            0,
            2,
            "`dx` is not a function; to multiply, write `dx * (…)`",
        ),
        (
            "1 + min(x)",
            4,
            10,
            "`min` takes at least 2 arguments, got 1",
        ),
        ("max()", 0, 5, "`max` takes at least 2 arguments, got 0"),
        (
            "2*ramp(t, 2*dx, 0)",
            2,
            18,
            "`ramp(a, start, end)` needs an `end` that is not below `start`; `start` is 1, `end` is 0",
        ),
        ("sin(x, y)", 0, 9, "`sin` takes 1 argument, got 2"),
        ("hypot(x)", 0, 8, "`hypot` takes 2 arguments, got 1"),
        ("if(x, 1)", 0, 8, "`if` takes 3 arguments, got 2"),
        (
            "1 || 0 < x <= 2 * y && 1",
            5,
            19,
            "comparisons cannot be chained: write `0 < x && x <= 2 * y`",
        ),
        (
            "a < b < c",
            0,
            1,
            "unknown name `a`; known here: x, y, z, t, dx, fo, later, pi",
        ),
        (
            "x < y < z",
            0,
            9,
            "comparisons cannot be chained: write `x < y && y < z`",
        ),
        (
            "not x < 1",
            0,
            9,
            "`not` binds tighter than `<`: write `not(x < 1)` or `(not x) < 1`",
        ),
        (
            "x = 1",
            2,
            3,
            "`=` is not an operator: to compare, write `==`",
        ),
        (
            "x ** 2",
            2,
            4,
            "`**` is not an operator: to raise to a power, write `^`",
        ),
        (
            "x & y",
            2,
            3,
            "`&` is not an operator: for a logical and, write `&&`",
        ),
        (
            "x | y",
            2,
            3,
            "`|` is not an operator: for a logical or, write `||`",
        ),
        ("x % 2", 2, 3, "unexpected character `%`"),
        ("x − 2", 2, 5, "unexpected character `−`"),
        ("1e999", 0, 5, "the number `1e999` is too large"),
    ] {
        let expected = ExpressionError {
            start,
            end,
            message: message.to_owned(),
        };
        assert_eq!(parse(text), Err(expected), "{text}");
    }
}

#[test]
fn an_unknown_function_lists_the_known_ones() {
    let error = parse("1 + flor(x)").unwrap_err();
    assert_eq!((error.start, error.end), (4, 8));
    let start = "unknown function `flor`; did you mean `floor`? functions are: sin, cos, tan, ";
    assert!(error.message.starts_with(start), "{error}");
}

#[test]
fn many_known_names_are_not_all_listed() {
    let names: Vec<String> = (0..100)
        .map(|number| format!("parameter_{number}"))
        .collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let error = Expression::parse("wrong", &|_| None, &names, &[]).unwrap_err();
    assert!(error.message.ends_with(", parameter_15, …"), "{error}");
}

#[test]
fn variables_are_only_allowed_where_they_have_a_value() {
    let message = |variables: &[Variable]| {
        Expression::parse("1 + t", &|_| None, &[], variables)
            .unwrap_err()
            .message
    };
    assert_eq!(
        message(&[Variable::X, Variable::Y]),
        "`t` cannot be used here: of the variables, this expression may use only x, y"
    );
    assert_eq!(
        message(&[]),
        "`t` cannot be used here: this expression must be constant"
    );
    assert!(Expression::parse("1 + t", &|_| None, &[], &[Variable::T]).is_ok());
}

#[test]
fn variables_and_pi_hide_parameters_but_functions_do_not() {
    let parse = |text| Expression::parse(text, &|_| Some(42.0), &[], &[Variable::X]).unwrap();
    assert!(parse("x").uses(Variable::X));
    assert_eq!(parse("pi").as_constant(), Some(std::f64::consts::PI));
    assert_eq!(parse("step + step(1)").as_constant(), Some(43.0));
}

#[test]
fn constants_and_used_variables_are_known() {
    let expression = parse("fo * dx + 2 * sin(0)").unwrap();
    assert_eq!(expression.as_constant(), Some(1.5));
    assert_eq!(expression, Expression::constant(1.5));
    let expression = parse("0 * x + t").unwrap();
    assert_eq!(expression.as_constant(), None);
    assert_eq!(
        ALL.map(|variable| expression.uses(variable)),
        [true, false, false, true]
    );
    let expression = parse("x < 1").unwrap();
    assert!(expression.is_true([0.0; 3], 0.0));
    assert!(!expression.is_true([1.0; 3], 0.0));
    assert!(!parse("sqrt(x)").unwrap().is_true([-1.0; 3], 0.0));
}

#[test]
fn names_leave_out_functions_constants_and_keywords() {
    let names = Expression::names("a*sin(b_1) + a^2 and not x < pi * 1e3 or step").unwrap();
    assert_eq!(names, ["a", "b_1", "x", "step"]);
    assert_eq!(Expression::names("").unwrap(), [""; 0]);
    assert_eq!(Expression::names("a + $").unwrap_err().start, 4);
}

#[test]
fn deep_nesting_is_an_error_and_long_sums_are_not() {
    let nested =
        |open: &str, depth, close: &str| format!("{}x{}", open.repeat(depth), close.repeat(depth));
    let deepest = super::parse::DEEPEST_NESTING;
    for (open, close) in [
        ("(", ")"),
        ("-", ""),
        ("!", ""),
        ("2^", ""),
        ("sin(", ")"),
        ("if(x, y, ", ")"),
        ("min(x, ", ")"),
    ] {
        let expression = parse(&nested(open, deepest, close)).unwrap();
        expression.evaluate([1.0; 3], 0.0);
        for depth in [deepest + 1, 100_000] {
            let error = parse(&nested(open, depth, close)).unwrap_err();
            assert_eq!(
                error.message,
                "nested too deeply: at most 200 levels are allowed"
            );
        }
    }
    assert_eq!(value(&nested("if(0*x, y, ", deepest - 1, ")")), 2.0);
    assert_eq!(value(&format!("0{}", " + x".repeat(100_000))), 200_000.0);
    assert_eq!(value(&format!("min(9{})", ", x".repeat(100_000))), 2.0);
}

/// A syntax tree. Its direct evaluation is the reference for parsed expressions.
#[derive(Debug, Clone)]
enum Tree {
    /// A nonnegative number.
    Number(f64),
    /// Index of one of four names.
    Name(usize),
    /// A prefix operator with its operand.
    Prefix(&'static str, Box<Tree>),
    /// An infix operator with its operands.
    Infix(&'static str, Box<Tree>, Box<Tree>),
    /// A function with its arguments.
    Call(&'static str, Vec<Tree>),
}

impl Tree {
    /// Evaluate the tree with these values of the names.
    fn value(&self, names: &[f64; 4]) -> f64 {
        let truth = |condition| if condition { 1.0 } else { 0.0 };
        let known = |value: f64| (!value.is_nan()).then_some(value != 0.0);
        let maybe = |condition: Option<bool>| condition.map_or(f64::NAN, truth);
        match self {
            Self::Number(number) => *number,
            Self::Name(index) => names[*index],
            Self::Prefix(sign, operand) => {
                let operand = operand.value(names);
                match *sign {
                    "+" => operand,
                    "-" => -operand,
                    "!" => maybe(known(operand).map(|operand| !operand)),
                    _ => unreachable!(),
                }
            }
            Self::Infix(operator, left, right) => {
                let (left, right) = (left.value(names), right.value(names));
                match *operator {
                    "+" => left + right,
                    "-" => left - right,
                    "*" => left * right,
                    "/" => left / right,
                    "^" if right.trunc() == right && (-16.0..=16.0).contains(&right) => {
                        left.powi(right as i32)
                    }
                    "^" => libm::pow(left, right),
                    "<" => truth(left < right),
                    "<=" => truth(left <= right),
                    ">" => truth(left > right),
                    ">=" => truth(left >= right),
                    "==" => truth(left == right),
                    "!=" => truth(left != right),
                    "&&" => maybe(match (known(left), known(right)) {
                        (Some(left), Some(right)) => Some(left && right),
                        (Some(false), _) | (_, Some(false)) => Some(false),
                        _ => None,
                    }),
                    "||" => maybe(match (known(left), known(right)) {
                        (Some(left), Some(right)) => Some(left || right),
                        (Some(true), _) | (_, Some(true)) => Some(true),
                        _ => None,
                    }),
                    _ => unreachable!(),
                }
            }
            Self::Call(function, arguments) => {
                let values: Vec<f64> = arguments
                    .iter()
                    .map(|argument| argument.value(names))
                    .collect();
                match (*function, values.as_slice()) {
                    ("sin", [a]) => libm::sin(*a),
                    ("exp", [a]) => libm::exp(*a),
                    ("log", [a]) => libm::log(*a),
                    ("sqrt", [a]) => a.sqrt(),
                    ("abs", [a]) => a.abs(),
                    ("floor", [a]) => a.floor(),
                    ("step", [a]) => maybe((!a.is_nan()).then_some(*a >= 0.0)),
                    ("atan2", [a, b]) => libm::atan2(*a, *b),
                    ("hypot", [a, b]) => libm::hypot(*a, *b),
                    ("if", [a, b, c]) => match known(*a) {
                        Some(true) => *b,
                        Some(false) => *c,
                        None => f64::NAN,
                    },
                    ("ramp", [a, b, c]) => {
                        if a >= c {
                            1.0
                        } else if a <= b {
                            0.0
                        } else {
                            (a - b) / (c - b)
                        }
                    }
                    ("min", all) => all.iter().copied().reduce(lesser).unwrap(),
                    ("max", all) => -all.iter().map(|a| -a).reduce(lesser).unwrap(),
                    _ => unreachable!(),
                }
            }
        }
    }

    /// Return the precedence of the outermost operator. An operator with a larger precedence binds more
    /// tightly.
    fn precedence(&self) -> u8 {
        match self {
            Self::Infix("||", ..) => 1,
            Self::Infix("&&", ..) => 2,
            Self::Infix("+" | "-", ..) => 4,
            Self::Infix("*" | "/", ..) => 5,
            Self::Infix("^", ..) => 7,
            Self::Infix(..) => 3,
            Self::Prefix(..) => 6,
            Self::Number(_) | Self::Name(_) | Self::Call(..) => 8,
        }
    }

    /// Return the text. If `minimal` is true, parentheses enclose only the operands that need them. If it is
    /// false, parentheses enclose all operands.
    fn text(&self, names: &[&str; 4], minimal: bool) -> String {
        let operand = |tree: &Self, needed: bool| {
            let text = tree.text(names, minimal);
            if needed || !minimal {
                format!("({text})")
            } else {
                text
            }
        };
        let own = self.precedence();
        match self {
            Self::Number(number) => format!("{number:?}"),
            Self::Name(index) => names[*index].to_owned(),
            Self::Prefix(sign, inner) => {
                format!("{sign}{}", operand(inner, inner.precedence() < own))
            }
            Self::Infix(operator, left, right) => {
                let (comparison, power) = (own == 3, own == 7);
                let left_needed = left.precedence() < own
                    || (left.precedence() == own && (comparison || power))
                    || (comparison && left.text(names, minimal).starts_with('!'));
                let right_needed = if power {
                    right.precedence() < 6
                } else {
                    right.precedence() <= own
                };
                format!(
                    "{} {operator} {}",
                    operand(left, left_needed),
                    operand(right, right_needed)
                )
            }
            Self::Call(function, arguments) => {
                let arguments: Vec<String> = arguments
                    .iter()
                    .map(|argument| operand(argument, false))
                    .collect();
                format!("{function}({})", arguments.join(", "))
            }
        }
    }
}

fn lesser(left: f64, right: f64) -> f64 {
    if left.is_nan() || right.is_nan() {
        f64::NAN
    } else if left < right {
        left
    } else {
        right
    }
}

fn trees() -> impl Strategy<Value = Tree> {
    let number = prop_oneof![
        (0..20u8).prop_map(f64::from),
        0.0..10.0,
        (any::<f64>().prop_map(f64::abs)).prop_filter("finite", |number| number.is_finite()),
    ];
    let leaf = prop_oneof![
        number.prop_map(Tree::Number),
        (0..4usize).prop_map(Tree::Name)
    ];
    leaf.prop_recursive(8, 64, 4, |inner| {
        let signs = prop::sample::select(vec!["+", "-", "!"]);
        let operators = prop::sample::select(vec![
            "+", "-", "*", "/", "^", "^", "<", "<=", ">", ">=", "==", "!=", "&&", "||",
        ]);
        let functions = prop::sample::select(vec![
            ("sin", 1..=1),
            ("exp", 1..=1),
            ("log", 1..=1),
            ("sqrt", 1..=1),
            ("abs", 1..=1),
            ("floor", 1..=1),
            ("step", 1..=1),
            ("atan2", 2..=2),
            ("hypot", 2..=2),
            ("if", 3..=3),
            ("ramp", 3..=3),
            ("min", 2..=4),
            ("max", 2..=4),
        ]);
        let arguments = inner.clone();
        prop_oneof![
            2 => (signs, inner.clone()).prop_map(|(sign, a)| Tree::Prefix(sign, Box::new(a))),
            6 => (operators, inner.clone(), inner).prop_map(|(operator, a, b)| {
                Tree::Infix(operator, Box::new(a), Box::new(b))
            }),
            2 => functions.prop_flat_map(move |(name, count)| {
                prop::collection::vec(arguments.clone(), count)
                    .prop_map(move |arguments| Tree::Call(name, arguments))
            }),
        ]
    })
}

/// Generate values of the four names: small integers, moderate numbers and arbitrary numbers.
fn values() -> impl Strategy<Value = [f64; 4]> {
    prop::array::uniform4(prop_oneof![
        (-17..18i8).prop_map(f64::from),
        -3.0..3.0,
        any::<f64>(),
    ])
}

/// Generate words and symbols of the language in any order.
fn jumbles() -> impl Strategy<Value = String> {
    let words = vec![
        "x", "t", "dx", "foo", "é", "1", "1e", ".", ".5", "e5", "(", "(", ")", ")", ",", "+", "-",
        "*", "/", "^", "<", "<=", "==", "=", "!", "!=", "&&", "&", "||", "and", "not", "min(",
        "if(", "sin(", "pi", " ", "\n", "**", "(1+", "2^", "-(",
    ];
    prop::collection::vec(prop::sample::select(words), 0..60).prop_map(|words| words.concat())
}

/// Test whether the text is evaluated, or rejected with an error whose byte range lies inside the text.
fn is_handled(text: &str) -> bool {
    let _ = Expression::names(text);
    match parse(text) {
        Ok(expression) => {
            expression.evaluate([1.0, -2.0, 0.0], 0.5);
            true
        }
        Err(error) => error.start <= error.end && text.get(error.start..error.end).is_some(),
    }
}

/// Test whether the text is rejected because of a ramp that ends before it starts.
fn has_reversed_ramp(parsed: &Result<Expression, ExpressionError>) -> bool {
    let error = parsed.as_ref().err();
    error.is_some_and(|error| error.message.starts_with("`ramp(a, start, end)`"))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn printed_trees_have_the_value_of_the_tree(tree in trees(), values in values()) {
        let [x, y, z, time] = values;
        let expected = tree.value(&values);
        for minimal in [false, true] {
            let text = tree.text(&["x", "y", "z", "t"], minimal);
            let parsed = parse(&text);
            if has_reversed_ramp(&parsed) {
                return Ok(());
            }
            let actual = parsed.unwrap().evaluate([x, y, z], time);
            prop_assert!(same(actual, expected), "{}: {}, not {}", text, actual, expected);
        }
    }

    #[test]
    fn folding_does_not_change_values(
        tree in trees(),
        values in values(),
        is_parameter in prop::array::uniform4(prop::bool::weighted(0.7)),
    ) {
        let [x, y, z, time] = values;
        let variables = ["x", "y", "z", "t"];
        let parameters = ["a", "b", "c", "d"];
        let mut names = variables;
        for index in (0..4).filter(|index| is_parameter[*index]) {
            names[index] = parameters[index];
        }
        let value_of = |name: &str| {
            parameters.iter().position(|parameter| *parameter == name).map(|index| values[index])
        };
        let text = tree.text(&names, true);
        let folded = Expression::parse(&text, &value_of, &parameters, &ALL);
        if has_reversed_ramp(&folded) {
            return Ok(());
        }
        let folded = folded.unwrap();
        let unfolded = parse(&tree.text(&variables, true)).unwrap();
        let expected = unfolded.evaluate([x, y, z], time);
        prop_assert!(same(folded.evaluate([x, y, z], time), expected), "{}", text);
        if !ALL.iter().any(|variable| folded.uses(*variable)) {
            prop_assert!(folded.as_constant().is_some_and(|value| same(value, expected)));
        }
    }

    #[test]
    fn arbitrary_strings_are_handled(text in any::<String>()) {
        prop_assert!(is_handled(&text));
    }

    #[test]
    fn jumbled_words_are_handled(text in jumbles()) {
        prop_assert!(is_handled(&text), "{}", text);
    }
}

#[test]
fn increments_have_the_rounding_of_a_change() {
    // The step is so small that slope and curvature give the change to all digits. A difference of two values
    // would keep at most seven digits.
    let (time, step) = (7.0, 1e-9);
    let sech = 1.0 - 1_f64.tanh().powi(2);
    let change = |text: &str| parse(text).unwrap().increment([2.0, 3.0, 5.0], time, step);
    for (text, slope, curvature) in [
        ("1e6 + 3*t", 3.0, 0.0),
        ("-(t - 1e6)/4", -0.25, 0.0),
        ("t^3", 147.0, 42.0),
        ("t^-2", -2.0 / 343.0, 6.0 / 2401.0),
        (
            "100*sin(3*t)",
            300.0 * 21.0_f64.cos(),
            -900.0 * 21.0_f64.sin(),
        ),
        ("cos(t)", -(7.0_f64.sin()), -(7.0_f64.cos())),
        ("exp(t/7)", 1_f64.exp() / 7.0, 1_f64.exp() / 49.0),
        ("log(t)", 1.0 / 7.0, -1.0 / 49.0),
        ("sqrt(t)", 0.5 / 7_f64.sqrt(), -0.25 * 7_f64.powf(-1.5)),
        ("t^0.5", 0.5 / 7_f64.sqrt(), -0.25 * 7_f64.powf(-1.5)),
        ("2^t", 128.0 * 2_f64.ln(), 128.0 * 2_f64.ln().powi(2)),
        ("x*t/(x + t)", 4.0 / 81.0, -8.0 / 729.0),
        ("if(t > 3, 5*t, 0)", 5.0, 0.0),
        ("if(t, 5*t, 0)", 5.0, 0.0),
        ("ramp(t, 6, 10)", 0.25, 0.0),
        ("ramp(t, 8, 10)", 0.0, 0.0),
        ("min(t, 8) + max(2*t, 1) + clamp(t, 0, 9)", 4.0, 0.0),
        ("abs(y - t)", 1.0, 0.0),
        ("hypot(t, 0*x)", 1.0, 0.0),
        ("tanh(t/7)", sech / 7.0, -2.0 * 1_f64.tanh() * sech / 49.0),
    ] {
        let expected = slope * step + 0.5 * curvature * step * step;
        let error = (change(text) - expected).abs();
        assert!(
            error <= 1e-13 * expected.abs(),
            "{text}: {} {expected}",
            change(text)
        );
    }
    // A jump within the step is the full change.
    assert_eq!(change("step(t - 7 - 1e-12)"), 1.0);
    assert_eq!(change("3 + x"), 0.0);
    assert!(change("if(sqrt(-t), 5*t, 0)").is_nan());
}
