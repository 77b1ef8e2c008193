"""What tests share: study folders and photographs made from formulas, a browser, rigs with known answers."""
