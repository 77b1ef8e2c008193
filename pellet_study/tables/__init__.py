"""Tables that other people's programs wrote: their encodings, separators, decimal signs, workbooks, headers and numbers.

numbers, encoding, headers, workbook < rows
"""
