//! Output of the commands for other programs.

use std::path::Path;
use std::process::{Command, Stdio};

use crate::support::command::{Folder, finish, fissure, skip, succeed, text};
use serde_json::Value;

fn json(printed: &str) -> Value {
    serde_json::from_str(printed).unwrap_or_else(|error| panic!("{error}: {printed}"))
}

#[test]
fn the_schema_is_json_and_the_same_each_time() {
    let print = || {
        // `finish` would hang, because the schema is larger than the buffer of a pipe.
        let output = fissure(1).arg("schema").output().unwrap();
        assert!(output.status.success(), "{}", text(&output));
        String::from_utf8(output.stdout).unwrap()
    };
    let printed = print();
    let schema = json(&printed);
    assert_eq!(schema["$schema"], "http://json-schema.org/draft-07/schema#");
    assert_eq!(
        schema["properties"]["grid"]["description"],
        "Spacing and horizon."
    );
    assert!(schema["properties"]["material"].is_object());
    assert_eq!(printed, print());
}

#[test]
fn completions_and_man_pages_name_all_commands() {
    let help = succeed(fissure(1).arg("--help"));
    let commands = help.split("Commands:").nth(1).unwrap();
    let commands = commands
        .lines()
        .skip(1)
        .take_while(|line| !line.trim().is_empty());
    let names = commands.filter_map(|line| line.split_whitespace().next());
    let names: Vec<&str> = names.filter(|name| *name != "help").collect();
    assert!(names.contains(&"sweep") && names.len() >= 12, "{names:?}");
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = succeed(fissure(1).args(["completions", shell]));
        for name in &names {
            assert!(script.contains(name), "{shell}: {name}");
        }
        assert!(script.contains("wall-time"), "{shell}");
    }
    let folder = Folder::new("man");
    let pages = folder.join("man1");
    succeed(fissure(1).arg("man").arg(&pages));
    for name in &names {
        let page = std::fs::read_to_string(pages.join(format!("fissure-{name}.1"))).unwrap();
        assert!(
            page.starts_with(".ie") || page.contains(".TH"),
            "{name}: {page}"
        );
        assert!(page.contains("fissure"), "{name}");
    }
    let output = finish(fissure(1).args(["completions", "tcsh"]));
    assert_eq!(output.status.code(), Some(2), "{}", text(&output));
}

#[test]
fn bash_completes_options() {
    let folder = Folder::new("completions");
    let path = folder.write(
        "fissure.bash",
        &succeed(fissure(1).args(["completions", "bash"])),
    );
    let script = format!(
        "source {}\nCOMP_WORDS=(fissure sweep --lau)\nCOMP_CWORD=2\n_fissure fissure --lau sweep\necho \"${{COMPREPLY[@]}}\"",
        path.display()
    );
    let Ok(output) = Command::new("bash").args(["-c", &script]).output() else {
        return skip("bash is not installed");
    };
    assert_eq!(text(&output).trim(), "--launcher");
}

#[test]
fn job_scripts_are_valid_for_bash() {
    let folder = Folder::new("slurm");
    for name in ["hybrid", "chain", "array"] {
        let script = succeed(fissure(1).args(["slurm", name]));
        let path = folder.write(name, &script);
        let output = Command::new("bash").arg("-n").arg(&path).output().unwrap();
        assert!(output.status.success(), "{name}: {}", text(&output));
        // Outside of a job and without arguments, the script prints what is missing.
        let output = Command::new("bash")
            .arg(&path)
            .stdin(Stdio::null())
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(2), "{name}: {}", text(&output));
        assert!(
            text(&output).contains("the arguments are missing"),
            "{name}"
        );
    }
}

#[test]
fn job_scripts_name_wrong_programs_and_tables() {
    let folder = Folder::new("slurm-mistakes");
    let header = folder.write("header.txt", "pull  dx\n");
    let none = folder.join("none.txt");
    for (name, launch, table, message) in [
        ("chain", "auto", &none, "error: false --version fails"),
        ("array", "auto", &none, "error: false --version fails"),
        ("array", "hydra", &none, "none.txt cannot be read"),
        (
            "array",
            "hydra",
            &header,
            "header.txt must have a line of names and at least one row",
        ),
    ] {
        let script = succeed(fissure(1).args(["slurm", name]));
        let path = folder.write(name, &script);
        let mut command = Command::new("bash");
        command.arg(&path).arg("deck.toml").arg(table).arg("out");
        command.envs([("FISSURE", "false"), ("LAUNCH", launch)]);
        command.envs([("SLURM_ARRAY_TASK_ID", "1"), ("SLURM_NTASKS", "1")]);
        let output = command.output().unwrap();
        let printed = text(&output);
        assert_eq!(output.status.code(), Some(2), "{name}: {printed}");
        assert_eq!(printed.matches("error: ").count(), 1, "{name}: {printed}");
        assert!(printed.contains(message), "{name}: {printed}");
    }
}

#[test]
fn check_prints_figures_as_json() {
    let folder = Folder::new("check-json");
    let deck = folder.join("plate.toml");
    succeed(fissure(1).arg("init").arg(&deck));
    let wrong = folder.write("wrong.toml", "dimension = '3d'\n");
    let output = finish(fissure(1).args(["check", "--json"]).arg(&deck).arg(&wrong));
    assert_eq!(output.status.code(), Some(2), "{}", text(&output));
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    let reports: Vec<Value> = printed.lines().map(json).collect();
    let [good, bad] = &reports[..] else {
        panic!("{printed}");
    };
    let human = succeed(fissure(1).arg("check").arg(&deck));
    let number = |name: &str| {
        let line = human
            .lines()
            .rfind(|line| line.trim_start().starts_with(name))
            .unwrap();
        let digits = line.trim_start().trim_start_matches(name).replace(' ', "");
        digits.parse::<u64>().unwrap()
    };
    assert_eq!(good["valid"], true);
    assert_eq!(good["points"], number("points"));
    assert_eq!(good["bonds"], number("bonds"));
    assert_eq!(good["stages"][0]["steps"], number("steps") as f64);
    assert_eq!(Path::new(good["deck"].as_str().unwrap()), deck);
    let body = &good["bodies"][0];
    let mass = body["density"].as_f64().unwrap() * body["volume"].as_f64().unwrap();
    assert!(
        (body["mass"].as_f64().unwrap() / mass - 1.0).abs() < 1e-12,
        "{body}"
    );
    assert_eq!(good["sets"]["all"], good["points"]);
    assert_eq!(bad["valid"], false);
    assert!(
        bad["error"].as_str().unwrap().contains("wrong.toml"),
        "{bad}"
    );

    // The points are too many for a dry run.
    let printed = succeed(
        fissure(1)
            .args(["check", "--json", "--set", "dx=1e-5"])
            .arg(&deck),
    );
    let report = json(&printed);
    assert_eq!(report["estimated"], true);
    assert!(report["points"].as_f64().unwrap() > 1e7, "{report}");
    assert!(
        report["stages"][0]["steps"].as_f64().unwrap() > 1e3,
        "{report}"
    );
}
