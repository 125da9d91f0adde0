"""Site of static pages with all topics, commands, codes and keys."""
