"""The component library: one small file per group of parts; every class here is a type in a circuit file."""
