//! Images out and in.
