"""Whether what is said is true: known truth, second opinions, random and broken inputs, weakened proofs."""
