//! Transfer functions that look right at once, from a volume's statistics.
