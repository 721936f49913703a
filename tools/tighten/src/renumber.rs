//! The functions of a module in another order.

use anyhow::{Result, anyhow, bail};
use std::convert::Infallible;
use wasm_encoder::reencode::{Error, Reencode};
use wasm_encoder::{CodeSection, FunctionSection, Module};
use wasmparser::{
    CodeSectionReader, FunctionBody, FunctionSectionReader, KnownCustom, Parser, Payload, TypeRef,
};

/// The functions that a module defines, in the order of their numbers.
pub struct Functions<'a> {
    /// The number of imported functions, which come before all others.
    pub imported: usize,
    /// The number of each function's type.
    pub types: Vec<u32>,
    /// Locals and instructions of each function.
    pub bodies: Vec<&'a [u8]>,
}

impl<'a> Functions<'a> {
    /// Reads the functions of a module.
    ///
    /// # Errors
    /// The module is damaged, or has names, which would be wrong afterwards.
    pub fn of(module: &'a [u8]) -> Result<Self> {
        let mut functions = Functions { imported: 0, types: Vec::new(), bodies: Vec::new() };
        for payload in Parser::new(0).parse_all(module) {
            match payload? {
                Payload::ImportSection(section) => {
                    for import in section.into_imports() {
                        functions.imported += usize::from(matches!(import?.ty, TypeRef::Func(_)));
                    }
                }
                Payload::FunctionSection(section) => {
                    functions.types = section.into_iter().collect::<Result<_, _>>()?;
                }
                Payload::CodeSectionEntry(body) => functions.bodies.push(body.as_bytes()),
                Payload::CustomSection(section) => match section.as_known() {
                    KnownCustom::Name(_) => bail!("the module has names: strip them before"),
                    _ if section.name().starts_with(".debug") => {
                        bail!("the module has debug information: strip it before")
                    }
                    _ => {}
                },
                _ => {}
            }
        }
        Ok(functions)
    }
}

/// Returns the module with the functions of `order`, in that order. Each use of function i becomes one of function `instead[i]`, which
/// is among them. Imported functions do not count.
pub fn renumbered(
    module: &[u8],
    functions: &Functions<'_>,
    order: &[usize],
    instead: &[usize],
) -> Result<Vec<u8>> {
    let mut places = vec![None; functions.bodies.len()];
    for (place, number) in order.iter().enumerate() {
        places[*number] = Some(functions.imported + place);
    }
    let imported = (0..functions.imported).map(Some);
    let numbers = imported.chain(instead.iter().map(|other| places[*other]));
    let numbers = numbers.map(|number| {
        Ok(u32::try_from(number.ok_or_else(|| anyhow!("a function that is used has no place"))?)?)
    });
    let mut renumber = Renumber { order, numbers: numbers.collect::<Result<_>>()? };
    let mut result = Module::new();
    renumber.parse_core_module(&mut result, Parser::new(0), module)?;
    Ok(result.finish())
}

struct Renumber<'o> {
    order: &'o [usize],
    /// The new number of each function, by its old one.
    numbers: Vec<u32>,
}

impl Reencode for Renumber<'_> {
    type Error = Infallible;

    fn function_index(&mut self, function: u32) -> Result<u32, Error> {
        // The parser does not check numbers.
        self.numbers.get(function as usize).copied().ok_or(Error::InvalidConstExpr)
    }

    fn parse_function_section(
        &mut self,
        functions: &mut FunctionSection,
        section: FunctionSectionReader<'_>,
    ) -> Result<(), Error> {
        let types: Vec<u32> = section.into_iter().collect::<Result<_, _>>()?;
        for number in self.order {
            functions.function(self.type_index(types[*number])?);
        }
        Ok(())
    }

    fn parse_code_section(
        &mut self,
        code: &mut CodeSection,
        section: CodeSectionReader<'_>,
    ) -> Result<(), Error> {
        let bodies: Vec<FunctionBody<'_>> = section.into_iter().collect::<Result<_, _>>()?;
        for number in self.order {
            self.parse_function_body(code, bodies[*number].clone())?;
        }
        Ok(())
    }
}
