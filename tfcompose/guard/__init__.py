"""The process that watches the live tree: it judges who publishes which edge, and how, and reports to the launcher."""
