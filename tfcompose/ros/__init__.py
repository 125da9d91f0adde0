"""The only importer of rclpy: nodes, the bytes of TFMessage, and who published them."""
