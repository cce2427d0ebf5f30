"""What users describe by keys and values: checked, told all mistakes at once, frozen."""
