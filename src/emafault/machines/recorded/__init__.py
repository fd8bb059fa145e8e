"""How recordings of measured machines are read and reduced to rows, and known changes of them."""
