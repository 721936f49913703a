//! Installs what the other commands need, by the ordinary clients.

use crate::shell::{Failure, Line, is_installed};

/// Debian packages that tasks need, each with a program that tells whether it is there.
const PACKAGES: &[(&str, &str)] = &[("cc", "gcc"), ("git", "git")];

/// Rust's part and the system's part.
pub fn run() -> Result<(), Failure> {
    rust()?;
    packages()
}

/// The toolchain, components and targets of `rust-toolchain.toml`; needs no network if they are there.
pub fn rust() -> Result<(), Failure> {
    // Cargo sets RUSTUP_TOOLCHAIN, which would hide the file and with it the targets.
    Line::new("rustup", &["toolchain", "install"]).without_env("RUSTUP_TOOLCHAIN").run()
}

fn packages() -> Result<(), Failure> {
    let missing = missing(is_installed);
    if missing.is_empty() {
        return Ok(());
    }
    let install = [&["install", "--yes", "--no-install-recommends"], missing.as_slice()].concat();
    if !is_root()? {
        let command = format!("sudo apt-get {}", install.join(" "));
        return Err(Failure::Packages { command });
    }
    Line::new("apt-get", &["update"]).run()?;
    Line::new("apt-get", &install).env("DEBIAN_FRONTEND", "noninteractive").run()
}

fn missing(is_installed: impl Fn(&str) -> bool) -> Vec<&'static str> {
    let absent = PACKAGES.iter().filter(|(program, _)| !is_installed(program));
    absent.map(|(_, package)| *package).collect()
}

fn is_root() -> Result<bool, Failure> {
    Ok(Line::new("id", &["-u"]).output(0)?.stdout.trim_ascii() == b"0")
}

#[cfg(test)]
mod tests {
    use super::missing;

    #[test]
    fn only_what_is_missing_is_installed() {
        assert!(missing(|_| true).is_empty());
        assert_eq!(missing(|program| program != "cc"), ["gcc"]);
    }
}
