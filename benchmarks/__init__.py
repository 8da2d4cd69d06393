"""Speed beside error, measured: what README.md beside this lists, from `metamer bench` or as scripts."""
