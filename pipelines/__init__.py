"""The stages from a store to a trained network, as polars pipelines from folder to folder."""
