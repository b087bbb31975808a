"""Commands on cameras and pictures: `cameras`, `grab`, `focus`, `trace`, `teach-table`."""
