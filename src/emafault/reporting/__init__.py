"""Pages, plots and the files that a diagnosis writes, apart from what computes them."""
