"""Robot programs: right ones, random ones, broken ones."""
