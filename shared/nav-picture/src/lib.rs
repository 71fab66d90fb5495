//! Floor 0: pictures that look the same everywhere. Who draws writes SVG; here it gets letters without a font
//! ([`lettering`]) and becomes a file, SVG or PNG ([`mod@file`]).

pub mod lettering;
pub mod file;
