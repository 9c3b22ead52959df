"""What a mechanism is made of: links and their bodies, joints, guides, stops, drives."""
