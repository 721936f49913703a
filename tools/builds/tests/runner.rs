//! `cargo run` in a board's folder names the program that is missing, and the command that installs
//! it.

use bittybuzz_builds::board::BOARDS;
use bittybuzz_builds::shell::root;
use std::fs;
use std::process::Command;
use toml::Table;

/// Returns the only runner in a board's configuration of cargo.
fn runner(folder: &str) -> Vec<String> {
    let config = fs::read_to_string(root().join(folder).join(".cargo/config.toml")).unwrap();
    let config: Table = config.parse().unwrap();
    let mut targets = config["target"].as_table().unwrap().values();
    let runner = targets.next().unwrap()["runner"].as_str().unwrap();
    assert!(targets.next().is_none(), "{folder}: several targets");
    runner.split(' ').map(str::to_owned).collect()
}

/// Returns the command that cargo executes for an image. Cargo resolves the path of the first word
/// from the folder that contains `.cargo`.
fn command(folder: &str, runner: &[String]) -> Command {
    let mut command = Command::new(root().join(folder).join(&runner[0]));
    command.args(&runner[1..]).arg("image");
    command
}

#[test]
fn a_missing_program_is_named_with_its_installation() {
    let manifest: Table = fs::read_to_string(root().join("Cargo.toml")).unwrap().parse().unwrap();
    let probe_rs = manifest["workspace"]["dependencies"]["probe-rs"]["version"].as_str().unwrap();
    for board in BOARDS {
        let folder = board.folder;
        let runner = runner(folder);
        let (install, guide) = match runner[1].as_str() {
            "probe-rs" => (
                format!("cargo install probe-rs-tools --version {probe_rs} --locked"),
                "docs/bring-up.md",
            ),
            "bbz" => ("cargo install --locked --path bbz".to_owned(), "docs/start.md"),
            other => panic!("{folder}: {other}"),
        };
        let output = command(folder, &runner).env("PATH", "").output().unwrap();
        assert_eq!(output.status.code(), Some(127), "{folder}");
        let expected = format!(
            "error: `cargo run` needs `{}`, which is not installed\n\
             help: run `{install}` in the folder of the repository; {guide} has more\n",
            runner[1]
        );
        assert_eq!(String::from_utf8(output.stderr).unwrap(), expected, "{folder}");
        assert!(root().join(guide).is_file(), "{guide}");
        let readme = fs::read_to_string(root().join(folder).join("README.md")).unwrap();
        assert!(readme.contains(&install), "{folder}: the README names another command");
    }
}

/// The program gets its own arguments and the image, and its exit code is that of `cargo run`.
#[test]
fn an_installed_program_is_run() {
    let output =
        command("firmware/crazyflie", &["../run.sh", "printf", "<%s>", "a b"].map(str::to_owned))
            .output()
            .unwrap();
    assert_eq!(String::from_utf8(output.stdout).unwrap(), "<a b><image>");
    let failing =
        command("firmware/crazyflie", &["../run.sh", "false"].map(str::to_owned)).output();
    assert_eq!(failing.unwrap().status.code(), Some(1));
}
