//! Robot files against the chips that probe-rs knows: chip names, memory layouts, sectors of flash. Only tests.
//!
//! `bbz flash`, `bbz trace` and `cargo run` of the firmware give probe-rs the name and the addresses from the robot
//! file. The tests read the descriptions from which probe-rs' own database is made; no probe is needed.

#[cfg(test)]
mod tests {
    use std::ops::Range;
    use std::path::PathBuf;
    use std::process::Command;
    use std::sync::LazyLock;

    use bittybuzz_robot_files::all_shipped;
    use bittybuzz_robot_spec::{Layout, Region, Robot};
    use fs_err as fs;
    use probe_rs_target::{Chip, ChipFamily, CoreType, MemoryRegion, RawFlashAlgorithm};
    use serde_json::Value;

    /// A chip as probe-rs describes it.
    struct Target {
        chip: Chip,
        flash_algorithms: Vec<RawFlashAlgorithm>,
    }

    /// Returns the folder of probe-rs' descriptions of chips, in the source that cargo has downloaded.
    fn descriptions() -> PathBuf {
        let metadata = Command::new(env!("CARGO"))
            .args(["metadata", "--locked", "--format-version", "1"])
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .output()
            .unwrap();
        assert!(metadata.status.success(), "{}", String::from_utf8_lossy(&metadata.stderr));
        let metadata: Value = serde_json::from_slice(&metadata.stdout).unwrap();
        let mut packages = metadata["packages"].as_array().unwrap().iter();
        let package = packages.find(|package| package["name"] == "probe-rs").unwrap();
        PathBuf::from(package["manifest_path"].as_str().unwrap()).with_file_name("targets")
    }

    /// Finds a chip by its exact name in the only family that has it.
    fn target(families: &[String], name: &str) -> Target {
        let is_described = |text: &&String| text.contains(&format!("name: {name}\n"));
        let texts: Vec<&String> = families.iter().filter(is_described).collect();
        assert_eq!(texts.len(), 1, "families with a chip {name}");
        let family: ChipFamily = yaml_serde::from_str(texts[0]).unwrap();
        family.validate().unwrap();
        let chip = family.variants.iter().find(|chip| chip.name == name).unwrap();
        let algorithm = |name: &String| family.get_algorithm(name).unwrap().clone();
        let flash_algorithms = chip.flash_algorithms.iter().map(algorithm).collect();
        Target { chip: chip.clone(), flash_algorithms }
    }

    /// The shipped robots that probe-rs flashes: it knows ARM, not the AVR of the Kilobot.
    static ROBOTS: LazyLock<Vec<(Robot, Target)>> = LazyLock::new(|| {
        let files = fs::read_dir(descriptions()).unwrap();
        let read = |file: fs::DirEntry| fs::read_to_string(file.path()).unwrap();
        let families: Vec<String> = files.map(|file| read(file.unwrap())).collect();
        let described = all_shipped().into_iter().filter_map(|robot| {
            let chip = robot.chip.as_deref().filter(|chip| chip.starts_with("STM32"))?;
            let target = target(&families, chip);
            Some((robot, target))
        });
        described.collect()
    });

    fn layouts() -> Vec<(Layout, &'static Target)> {
        ROBOTS.iter().filter_map(|(robot, target)| Some((robot.layout?, target))).collect()
    }

    fn bytes(region: Region) -> Range<u64> {
        u64::from(region.address)..u64::from(region.end())
    }

    fn contains(outer: &Range<u64>, inner: &Range<u64>) -> bool {
        outer.start <= inner.start && inner.end <= outer.end
    }

    /// Ranges that touch are one.
    fn joined(mut ranges: Vec<Range<u64>>) -> Vec<Range<u64>> {
        ranges.sort_by_key(|range| range.start);
        let mut joined: Vec<Range<u64>> = Vec::new();
        for range in ranges {
            match joined.last_mut() {
                Some(last) if last.end == range.start => last.end = range.end,
                _ => joined.push(range),
            }
        }
        joined
    }

    fn flash(target: &Target) -> Vec<Range<u64>> {
        let regions = target.chip.memory_map.iter().filter_map(MemoryRegion::as_nvm_region);
        joined(regions.map(|region| region.range.clone()).collect())
    }

    fn ram(target: &Target) -> Vec<Range<u64>> {
        let regions = target.chip.memory_map.iter().filter_map(MemoryRegion::as_ram_region);
        joined(regions.map(|region| region.range.clone()).collect())
    }

    /// The sectors in which probe-rs erases a part of the flash, by the algorithm that it chooses by itself.
    fn sectors(target: &Target, part: &Range<u64>) -> Vec<Range<u64>> {
        let algorithms = target.flash_algorithms.iter().filter(|algorithm| algorithm.default);
        let mut properties = algorithms.map(|algorithm| &algorithm.flash_properties);
        let properties =
            properties.find(|properties| contains(&properties.address_range, part)).unwrap();
        let range = &properties.address_range;
        let mut sectors = Vec::new();
        for (index, sector) in properties.sectors.iter().enumerate() {
            let next = properties.sectors.get(index + 1);
            let end = next.map_or(range.end, |next| range.start + next.address);
            let mut at = range.start + sector.address;
            while at < end {
                sectors.push(at..at + sector.size);
                at += sector.size;
            }
        }
        sectors
    }

    #[test]
    fn the_chips_are_known_by_exactly_these_names() {
        assert!(ROBOTS.iter().any(|(robot, _)| robot.name == "crazyflie"));
        for (robot, target) in ROBOTS.iter() {
            assert_eq!(robot.chip.as_ref(), Some(&target.chip.name));
        }
    }

    #[test]
    fn the_crazyflie_has_a_core_with_floating_point() {
        let mut robots = ROBOTS.iter();
        let (_, target) = robots.find(|(robot, _)| robot.name == "crazyflie").unwrap();
        assert_eq!(target.chip.cores[0].core_type, CoreType::Armv7em);
    }

    #[test]
    fn every_region_lies_in_memory_of_its_kind() {
        assert!(!layouts().is_empty());
        for (layout, target) in layouts() {
            for region in [layout.application, layout.script] {
                let region = bytes(region);
                assert!(flash(target).iter().any(|bank| contains(bank, &region)), "{region:x?}");
            }
            for region in [Some(layout.ram), layout.stack].into_iter().flatten() {
                let region = bytes(region);
                assert!(ram(target).iter().any(|bank| contains(bank, &region)), "{region:x?}");
            }
        }
    }

    /// All of it, so that nothing of the chip is forgotten: a layout that says less is a mistake.
    #[test]
    fn ram_is_described_whole() {
        for (layout, target) in layouts() {
            let mut described: Vec<Range<u64>> =
                [Some(layout.ram), layout.stack].into_iter().flatten().map(bytes).collect();
            described.sort_by_key(|range| range.start);
            assert_eq!(joined(described), ram(target));
        }
    }

    #[test]
    fn the_script_shares_no_sector() {
        for (layout, target) in layouts() {
            let script = bytes(layout.script);
            let sectors = sectors(target, &script);
            assert!(sectors.iter().any(|sector| sector.start == script.start), "{sectors:x?}");
            assert!(sectors.iter().any(|sector| sector.end == script.end), "{sectors:x?}");
        }
    }

    /// Else writing the firmware would erase the end of the boot loader.
    #[test]
    fn the_application_begins_a_sector() {
        for (layout, target) in layouts() {
            let application = bytes(layout.application);
            let sectors = sectors(target, &application);
            assert!(sectors.iter().any(|sector| sector.start == application.start), "{sectors:x?}");
        }
    }
}
