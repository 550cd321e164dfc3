"""What the fuzzer gives each format of scan files; one file a format, as derain has them."""
