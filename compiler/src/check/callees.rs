//! The built-ins and functions that expressions refer to for certain.

use bittybuzz_vm_core::builtin::{self, BuiltinInfo, Library};

use crate::check::names::{LibraryMember, Meaning, Meanings};
use crate::check::tree::{CheckedExpr, CheckedExprKind, FunctionId};

impl Meanings<'_> {
    /// Returns the built-in that an expression certainly refers to, also as a method of an object.
    pub fn built_in(&self, callee: &CheckedExpr) -> Option<&'static BuiltinInfo> {
        match &callee.kind {
            CheckedExprKind::Name(name) => match self.of(*name) {
                Meaning::Builtin(number) => builtin::info(number),
                _ => None,
            },
            CheckedExprKind::Field { object, key, .. } => match self.library(object) {
                Some(library) => match self.member(library, key) {
                    LibraryMember::Known(info) => Some(info),
                    LibraryMember::Absent | LibraryMember::Changing => None,
                },
                None => builtin::find(self.object_of(object)?, key),
            },
            _ => None,
        }
    }

    /// Returns the script function that an expression certainly refers to.
    pub fn function(&self, expr: &CheckedExpr) -> Option<FunctionId> {
        match expr.kind {
            CheckedExprKind::Lambda(function) => Some(function),
            CheckedExprKind::Name(name) => match self.of(name) {
                Meaning::Function(function) => Some(function),
                _ => None,
            },
            _ => None,
        }
    }

    /// Returns the kind of object that an expression certainly yields.
    pub fn object_of(&self, expr: &CheckedExpr) -> Option<Library> {
        match &expr.kind {
            CheckedExprKind::Call { callee, .. } => match self.built_in(callee)?.number {
                builtin::STIGMERGY_CREATE => Some(Library::StigmergyObject),
                builtin::SWARM_CREATE => Some(Library::SwarmObject),
                builtin::NEIGHBORS_KIN
                | builtin::NEIGHBORS_NONKIN
                | builtin::NEIGHBORS_MAP
                | builtin::NEIGHBORS_FILTER
                | builtin::SNAPSHOT_MAP
                | builtin::SNAPSHOT_FILTER => Some(Library::Snapshot),
                _ => None,
            },
            CheckedExprKind::Name(name) => self.object(*name),
            _ => None,
        }
    }
}
