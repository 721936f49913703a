//! Writes 600,000 rows of a usual study to memory as Parquet, and prints their size.
//!
//! The instructions of the writer: `valgrind --tool=callgrind --toggle-collect='cost::write*' target/release/examples/cost`.

use bittybuzz_tables::{Block, Cells, Column, Form, Kind, Schema, TableError, TableWriter};

const ROBOTS: i32 = 100;
/// Times of each robot, a second apart.
const TIMES: i32 = 6000;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let numbers =
        ["run", "tick", "robot", "x_tenths_mm", "y_tenths_mm", "heading_tenths_deg", "led"];
    let mut columns: Vec<Column> =
        numbers.iter().map(|name| Column::new(*name, Kind::OptionalInteger)).collect();
    for column in &mut columns[..3] {
        column.kind = Kind::Integer;
    }
    columns.push(Column::new("state", Kind::OptionalText));
    let schema = Schema::new(columns)?;
    let block = Block::new(&schema, cells())?;
    let bytes = write(&schema, &block)?;
    println!("{} rows, {:.2} bytes each", block.rows(), bytes as f64 / block.rows() as f64);
    Ok(())
}

/// Returns robots that walk at about 10 mm/s, change their LED now and then, and fail late or never.
fn cells() -> Vec<Cells> {
    let mut random = 1u32;
    let mut step = |size: u32| {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((random >> 16) % (2 * size + 1)) as i32 - size as i32
    };
    let mut keys: [Vec<i32>; 3] = Default::default();
    let mut poses: [Vec<Option<i32>>; 4] = Default::default();
    let mut states = Vec::new();
    for robot in 0..ROBOTS {
        let (mut x, mut y, mut heading, mut led) = (robot * 300, 0, 0, 0);
        for time in 0..TIMES {
            x += step(100);
            y += step(100);
            heading = (heading + step(60)).rem_euclid(3600);
            if time % 37 == robot % 37 {
                led = (led + step(3)).rem_euclid(4);
            }
            keys.iter_mut().zip([1, time * 10, robot]).for_each(|(column, key)| column.push(key));
            let pose = [x, y, heading, led].map(Some);
            poses.iter_mut().zip(pose).for_each(|(column, cell)| column.push(cell));
            let has_failed = robot % 7 == 0 && time > 5 * TIMES / 6;
            states.push(Some(if has_failed { "failed" } else { "running" }.to_owned()));
        }
    }
    let cells = keys.into_iter().map(Cells::Integers);
    let cells = cells.chain(poses.into_iter().map(Cells::OptionalIntegers));
    cells.chain([Cells::OptionalTexts(states)]).collect()
}

#[inline(never)] // Callgrind counts in this function.
fn write(schema: &Schema, block: &Block) -> Result<usize, TableError> {
    let mut writer = TableWriter::new(Vec::new(), Form::Parquet, schema)?;
    writer.write(block)?;
    Ok(writer.finish()?.len())
}
