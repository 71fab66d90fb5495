//! Driving in order to learn: one robot in one world ([`episode`]), the worlds ([`worlds`]), and what each
//! level sees of it ([`low`], [`high`]).

pub mod episode;
pub mod high;
pub mod low;
pub mod policy;
pub mod worlds;
