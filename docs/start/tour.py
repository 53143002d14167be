# %% [markdown]
# # From logs to a verdict, in Python
#
# Run this from a clone of shiplog, as a script or cell by cell. The ship of `sample_logs` is
# simulated; what is hidden in its logs stands in `sample_logs/answers`.

# %%
import shiplog

# %% [markdown]
# MCAP logs become voyages in a store: one 10 Hz table per voyage, reduced to midship, with faults
# marked.

# %%
taken = shiplog.ingest("sample_logs", "tour/store")
print(taken)
store = taken.store
store.voyages()  # a polars frame

# %% [markdown]
# A voyage is in the store by its name, with its rows at 10 Hz and 1 Hz, its profile and findings.

# %%
voyage = store["voyage_6"]
voyage.seconds, voyage.rows_1hz.shape, voyage.findings

# %% [markdown]
# A model of the ship as it was in season 1. `model` is `mmg` (physics, identified), `feedforward`
# (the published network) or `hybrid`.

# %%
run = shiplog.train(store, "tour/mmg", model="mmg", voyages=["voyage_1", "voyage_2"], folds=0)
run.coefficients["hull.y_v"]

# %% [markdown]
# The model against a voyage that it was not trained on, and two baselines.

# %%
scored = shiplog.evaluate(run, store, "voyage_6")
print(scored)
scored.errors

# %%
scored.loss, scored.baselines

# %%
pictures = shiplog.compare(run, store, "voyage_6", save="tour/compare.rrd")
print(f"rerun --bind 127.0.0.1 {pictures.recording}")

# %% [markdown]
# What the model gets wrong half a year later, why, and what is gained by putting it right.

# %%
found = shiplog.diagnose(run, store, "season2_*", out="tour/diagnosis", extend="tour/mmg2")
print(found)
found.ranking
