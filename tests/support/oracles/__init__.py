"""Second opinions: other libraries, another collision engine, plain MuJoCo."""
