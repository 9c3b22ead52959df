"""Numbers of the documents: which study gives them, the files they are kept in, and the pages that quote them."""
