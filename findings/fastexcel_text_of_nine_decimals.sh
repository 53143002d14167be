#!/usr/bin/env bash
# fastexcel 0.21.0, which polars 2.1.0 reads Excel workbooks with: a number that is asked for as text
# has nine decimals. 1.5e-10 becomes "0", and a latitude in radians loses up to 3 mm. polars asks for
# text where it is told not to infer types (infer_schema_length=0), as its reader of CSV is for files
# that shall be looked at cell by cell. A guess would be the digits that the workbook holds, which the
# same cell has in a column of numbers.
#
# Seen: "0.123456789012345 and 1.5e-10 are, as numbers, 0.123456789012345 and 1.5e-10; as text of
# fastexcel 0.123456789 and 0, of polars 0.123456789 and 0".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'fastexcel==0.21.0' 'polars==2.1.0' 'XlsxWriter==3.3.1'
cd "$work"
"$work/venv/bin/python" - <<'P'
import fastexcel
import polars
import xlsxwriter

VALUES = (0.123456789012345, 1.5e-10)
book = xlsxwriter.Workbook("trial.xlsx")
book.add_worksheet("Log").write_column(0, 0, ["value", *VALUES])
book.close()
reader = fastexcel.read_excel("trial.xlsx")
frames = (
    reader.load_sheet("Log").to_polars(),
    reader.load_sheet("Log", dtypes="string").to_polars(),
    polars.read_excel("trial.xlsx", infer_schema_length=0),
)
plain, text, of_polars = (" and ".join(map(str, one["value"].to_list())) for one in frames)
print(
    f"{VALUES[0]} and {VALUES[1]} are, as numbers, {plain}; as text of fastexcel {text}, of "
    f"polars {of_polars}"
)
assert plain == f"{VALUES[0]} and {VALUES[1]}", plain
assert text == of_polars == "0.123456789 and 0", f"this has changed: {text}, {of_polars}"
P
