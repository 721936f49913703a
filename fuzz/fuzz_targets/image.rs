#![no_main]

libfuzzer_sys::fuzz_target!(
    init: {
        // Writes the images to start from, for a run that executes no input.
        if let Some(folder) = std::env::var_os("BITTYBUZZ_IMAGES") {
            for (number, image) in bittybuzz_fuzz_bodies::images().iter().enumerate() {
                let path = std::path::Path::new(&folder).join(format!("known-{number}"));
                std::fs::write(path, image).expect("the folder can be written");
            }
        }
    },
    |data: &[u8]| {
        bittybuzz_fuzz_bodies::image(data);
    }
);
