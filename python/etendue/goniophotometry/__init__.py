"""What a goniophotometer would measure of rays: far-field intensity, and how well two distributions agree."""
