//! Tables as other programs read them: Parquet by the library's own reader, CSV as RFC 4180 has it.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

use std::io::{self, Write};

use bittybuzz_tables::{
    Block, BlockError, Cells, Column, Form, Kind, Schema, SchemaError, TableError, TableWriter,
};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use proptest::prelude::*;

fn schema() -> Schema {
    let column = |name: &str, kind| Column::new(name, kind);
    Schema::new(vec![
        column("tick", Kind::Integer),
        column("x_tenths_mm", Kind::OptionalInteger),
        column("global.share", Kind::OptionalNumber),
        column("state", Kind::OptionalText),
    ])
    .unwrap()
}

/// A row of the schema.
type Row = (i32, Option<i32>, Option<f64>, Option<String>);

fn block(rows: &[Row]) -> Block {
    let cells = vec![
        Cells::Integers(rows.iter().map(|row| row.0).collect()),
        Cells::OptionalIntegers(rows.iter().map(|row| row.1).collect()),
        Cells::OptionalNumbers(rows.iter().map(|row| row.2).collect()),
        Cells::OptionalTexts(rows.iter().map(|row| row.3.clone()).collect()),
    ];
    Block::new(&schema(), cells).unwrap()
}

fn written(form: Form, blocks: &[&[Row]]) -> Vec<u8> {
    let mut writer = TableWriter::new(Vec::new(), form, &schema()).unwrap();
    for rows in blocks {
        writer.write(&block(rows)).unwrap();
    }
    writer.finish().unwrap()
}

/// Reads a Parquet file by the names and types in the file.
fn read(file: Vec<u8>) -> Vec<Row> {
    let reader = SerializedFileReader::new(bytes::Bytes::from(file)).unwrap();
    let rows = reader.get_row_iter(None).unwrap();
    rows.map(|row| {
        let row = row.unwrap();
        let cells: Vec<(&String, &Field)> = row.get_column_iter().collect();
        let [(tick, t), (x, x_value), (share, s), (state, text)] = cells[..] else {
            panic!("{cells:?}")
        };
        assert_eq!([tick, x, share, state], ["tick", "x_tenths_mm", "global.share", "state"]);
        let Field::Int(t) = t else { panic!("{t:?}") };
        let x_value = match x_value {
            Field::Int(value) => Some(*value),
            Field::Null => None,
            other => panic!("{other:?}"),
        };
        let s = match s {
            Field::Double(value) => Some(*value),
            Field::Null => None,
            other => panic!("{other:?}"),
        };
        let text = match text {
            Field::Str(text) => Some(text.clone()),
            Field::Null => None,
            other => panic!("{other:?}"),
        };
        (*t, x_value, s, text)
    })
    .collect()
}

fn row() -> impl Strategy<Value = Row> {
    let number = prop_oneof![any::<f64>(), Just(0.1), Just(-0.0), Just(f64::INFINITY)];
    (any::<i32>(), any::<Option<i32>>(), proptest::option::of(number), any::<Option<String>>())
}

proptest! {
    #[test]
    fn parquet_gives_back_all_rows(
        blocks in proptest::collection::vec(proptest::collection::vec(row(), 0..40), 0..4),
    ) {
        let slices: Vec<&[Row]> = blocks.iter().map(Vec::as_slice).collect();
        let file = written(Form::Parquet, &slices);
        prop_assert_eq!(&file, &written(Form::Parquet, &slices));
        let bits = |rows: Vec<Row>| -> Vec<_> {
            rows.into_iter().map(|(t, x, s, text)| (t, x, s.map(f64::to_bits), text)).collect()
        };
        prop_assert_eq!(bits(read(file)), bits(blocks.concat()));
    }
}

#[test]
fn csv_has_quotes_where_readers_need_them() {
    let text = |text: &str| Some(text.to_owned());
    let rows = [
        (0, Some(-5), Some(0.5), text("running")),
        (1, None, None, None),
        (2, Some(7), Some(f64::NAN), text("a \"b\", c\r\nd")),
        (3, Some(i32::MIN), Some(1e300), text("")),
    ];
    let file = String::from_utf8(written(Form::Csv, &[&rows[..2], &[], &rows[2..]])).unwrap();
    let large = format!("1{}", "0".repeat(300));
    assert_eq!(
        file,
        format!(
            "tick,x_tenths_mm,global.share,state\r\n\
             0,-5,0.5,running\r\n\
             1,,,\r\n\
             2,7,NaN,\"a \"\"b\"\", c\r\nd\"\r\n\
             3,-2147483648,{large},\"\"\r\n"
        )
    );
}

#[test]
fn a_table_without_rows_has_its_columns() {
    assert_eq!(read(written(Form::Parquet, &[])), []);
    assert_eq!(written(Form::Csv, &[]), b"tick,x_tenths_mm,global.share,state\r\n");
}

/// 100 robots of which each walks at about 10 mm/s for 15 minutes, in the columns of a usual study.
#[test]
fn poses_take_less_than_six_bytes_per_row() {
    let names = ["run", "tick", "robot", "x_tenths_mm", "y_tenths_mm", "heading_tenths_deg"];
    let required = names.map(|name| Column::new(name, Kind::Integer));
    let optional = ["led", "global.opinion"].map(|name| Column::new(name, Kind::OptionalInteger));
    let schema = Schema::new(required.into_iter().chain(optional).collect()).unwrap();
    let mut random = 1u32;
    let mut step = |size: u32| {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((random >> 16) % (2 * size + 1)) as i32 - size as i32
    };
    let mut columns: [Vec<i32>; 6] = Default::default();
    let mut states: [Vec<Option<i32>>; 2] = Default::default();
    for robot in 0..100 {
        let (mut x, mut y, mut heading, mut led) = (robot * 300, 0, 0, 0);
        for second in 0..901 {
            x += step(100);
            y += step(100);
            heading = (heading + step(60)).rem_euclid(3600);
            if second % 37 == robot % 37 {
                led = (led + step(3)).rem_euclid(4);
            }
            let cells = [1, second * 10, robot, x, y, heading];
            columns.iter_mut().zip(cells).for_each(|(column, cell)| column.push(cell));
            states.iter_mut().for_each(|column| column.push(Some(led)));
        }
    }
    let cells = columns.into_iter().map(Cells::Integers);
    let cells = cells.chain(states.into_iter().map(Cells::OptionalIntegers)).collect();
    let block = Block::new(&schema, cells).unwrap();
    let mut writer = TableWriter::new(Vec::new(), Form::Parquet, &schema).unwrap();
    writer.write(&block).unwrap();
    let file = writer.finish().unwrap();
    let bytes = file.len() as f64 / block.rows() as f64;
    assert!(bytes < 6.0, "{bytes} bytes per row");
}

#[test]
fn columns_that_make_no_table_are_refused() {
    let column = |name: &str| Column::new(name, Kind::Integer);
    assert_eq!(Schema::new(Vec::new()), Err(SchemaError::Empty));
    assert_eq!(Schema::new(vec![column("a"), column("")]), Err(SchemaError::NoName(1)));
    let twice = Schema::new(vec![column("a"), column("b"), column("a")]);
    assert_eq!(twice, Err(SchemaError::SameName("a".to_owned())));
}

#[test]
fn rows_of_another_table_are_refused() {
    let schema =
        Schema::new(vec![Column::new("a", Kind::Integer), Column::new("b", Kind::OptionalNumber)])
            .unwrap();
    let ones = || Cells::Integers(vec![1, 1]);
    assert_eq!(
        Block::new(&schema, vec![ones()]),
        Err(BlockError::Columns { given: 1, expected: 2 })
    );
    let kind = Block::new(&schema, vec![ones(), ones()]);
    assert_eq!(kind, Err(BlockError::Kind { name: "b".to_owned() }));
    let length = Block::new(&schema, vec![ones(), Cells::OptionalNumbers(vec![None])]);
    let expected = BlockError::Length { name: "b".to_owned(), given: 1, expected: 2 };
    assert_eq!(length, Err(expected));
    assert_eq!(Block::new(&schema, vec![ones(), Cells::of(Kind::OptionalNumber)]).ok(), None);
}

/// An output on a disk that is full after some bytes.
struct FullDisk(usize);

impl Write for FullDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.0 < bytes.len() {
            return Err(io::Error::from(io::ErrorKind::StorageFull));
        }
        self.0 -= bytes.len();
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_full_disk_is_an_error_of_the_output() {
    for form in [Form::Parquet, Form::Csv] {
        for room in [0, 30, 60] {
            let rows: Vec<Row> = (0..100_000).map(|n| (n * 7919 % 997, None, None, None)).collect();
            let result = TableWriter::new(FullDisk(room), form, &schema()).and_then(|mut table| {
                table.write(&block(&rows))?;
                table.finish().map(|_| ())
            });
            let Err(TableError::Output(error)) = result else { panic!("{form:?} {room}") };
            assert_eq!(error.kind(), io::ErrorKind::StorageFull);
        }
    }
}
