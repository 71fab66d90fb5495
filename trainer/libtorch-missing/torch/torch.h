// The compiler gets here only when LIBTORCH names a folder without libtorch's headers.
#include "libtorch is not set up: run `cargo xtask libtorch` once, then build again"
