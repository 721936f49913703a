//! Links through `bittybuzz_squeeze`.

fn main() {
    bittybuzz_squeeze::build_script(bittybuzz_squeeze::PATHS);
}
