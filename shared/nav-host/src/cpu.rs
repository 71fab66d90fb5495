//! What figures were measured on.

use std::fs;

/// The processor's name and how many cores the system sees, as Linux tells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cpu {
    /// Its name; the architecture's where the system does not say.
    pub name: String,
    /// Cores that the system sees.
    pub cores: usize,
}

impl Cpu {
    /// Of this machine.
    pub fn of_this_machine() -> Self {
        Self::parse(&fs::read_to_string("/proc/cpuinfo").unwrap_or_default())
    }

    fn parse(cpu_info: &str) -> Self {
        let name = cpu_info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
        let name = name.map_or(std::env::consts::ARCH, |(_, name)| name).to_owned();
        Self { name, cores: cpu_info.lines().filter(|line| line.starts_with("processor")).count() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn name_and_cores_are_found() {
        let text =
            "processor\t: 0\nmodel name\t: Some CPU @ 2: fast\n\nprocessor\t: 1\nmodel name\t: Some CPU\n";
        assert_eq!(Cpu::parse(text), Cpu { name: "Some CPU @ 2: fast".to_owned(), cores: 2 });
        assert_eq!(Cpu::parse("").name, std::env::consts::ARCH);
    }
}
