"""What tests share: meshes, cases, arms, browsers."""
