# Answers of base R (lm, anova, drop1, predict, eigen, solve) for the tables of a list; see compare_with_r.py.
# Run: Rscript benchmarks/compare_with_r.R TABLES.csv ANSWERS.csv    (R 4 of Debian's r-base-core; no other package)

paths <- commandArgs(trailingOnly = TRUE)
tables <- read.csv(paths[1], colClasses = "character", check.names = FALSE)
answers <- list()

say <- function(table, quantity, item, value) {
  value <- unname(as.numeric(value))
  answers[[length(answers) + 1]] <<- data.frame(table = table, quantity = quantity, item = item, value = value)
}

# coded columns: (x - centre) / half range; columns of -1, 0, 1 (and axial levels beyond) stay as they are
coded <- function(data, factors) {
  for (word in strsplit(factors, ";")[[1]]) {
    name <- sub("=.*", "", word)
    ends <- as.numeric(strsplit(sub(".*=", "", word), ":")[[1]])
    if (!all(c(-1, 1) %in% data[[name]])) data[[name]] <- (data[[name]] - mean(ends)) / (diff(ends) / 2)
  }
  data
}

rows_of_terms <- function(table, fit, terms) {
  found <- summary(fit)$coefficients
  for (term in names(terms)) {
    say(table, "coefficient", terms[[term]], found[term, 1])
    if (df.residual(fit) > 0) {
      say(table, "standard error", terms[[term]], found[term, 2])
      if (term != "(Intercept)") say(table, "p", terms[[term]], found[term, 4])
    }
  }
}

lack_of_fit <- function(table, fit, data, names) {
  data$cell <- interaction(data[names], drop = TRUE)
  full <- lm(y ~ cell, data)
  if (df.residual(full) == 0 || df.residual(full) == df.residual(fit)) return(invisible())
  say(table, "lack of fit p", "", anova(fit, full)[["Pr(>F)"]][2])
}

lenth <- function(table, effects, alpha = 0.05) {
  sizes <- abs(effects)
  m <- length(sizes)
  pse <- 1.5 * median(sizes[sizes < 2.5 * 1.5 * median(sizes)])
  say(table, "Lenth", "pseudo_standard_error", pse)
  say(table, "Lenth", "margin_of_error", qt(1 - alpha / 2, m / 3) * pse)
  say(table, "Lenth", "simultaneous_margin_of_error", qt((1 + (1 - alpha)^(1 / m)) / 2, m / 3) * pse)
}

screening <- function(spec, data, names, block) {
  table <- spec$table
  data$centre <- as.numeric(rowSums(data[names] != 0) == 0)
  words <- c(names, if (any(data$centre == 1)) "centre", if (nzchar(block)) block)
  if (nzchar(block)) contrasts(data[[block]]) <- contr.sum(nlevels(data[[block]]))
  fit <- lm(reformulate(words, "y"), data)
  rows_of_terms(table, fit, setNames(as.list(c("1", names)), c("(Intercept)", names)))
  for (name in names) say(table, "effect", name, 2 * coef(fit)[name])
  parts <- drop1(fit, setdiff(words, block))
  for (name in names) say(table, "sum of squares", name, parts[name, "Sum of Sq"])
  say(table, "sum of squares", "residual", deviance(fit))
  if ("centre" %in% words) {
    say(table, "sum of squares", "curvature", parts["centre", "Sum of Sq"])
    if (df.residual(fit) > 0) say(table, "p", "curvature", summary(fit)$coefficients["centre", 4])
  }
  lack_of_fit(table, fit, data, c(names, if (nzchar(block)) block))
  if (df.residual(fit) == 0) lenth(table, 2 * coef(fit)[names])
  if (nzchar(spec$climb)) climb(spec, fit, data, names)
}

# from the centre in steps of one factor along the gradient, all factors moving; levels physical
climb <- function(spec, fit, data, names) {
  first <- sub("=.*", "", spec$climb)
  size <- as.numeric(sub(".*=", "", spec$climb))
  ends <- setNames(rep(list(c(-1, 1)), length(names)), names)
  for (word in strsplit(spec$factors, ";")[[1]]) {
    ends[[sub("=.*", "", word)]] <- as.numeric(strsplit(sub(".*=", "", word), ":")[[1]])
  }
  half <- sapply(ends, function(e) diff(e) / 2)[names]
  slope <- coef(fit)[names]
  move <- slope / abs(slope[first]) * abs(size / half[first])
  for (k in 0:2) {
    say(spec$table, "path prediction", paste("point", k + 1), coef(fit)[1] + k * sum(move * slope))
    for (name in names) {
      say(spec$table, "path level", paste(name, "point", k + 1), mean(ends[[name]]) + k * move[name] * half[name])
    }
  }
}

surface <- function(spec, data, names, block) {
  table <- spec$table
  squares <- sprintf("I(%s^2)", names)
  products <- if (length(names) > 1) combn(names, 2, paste, collapse = ":") else character()
  if (nzchar(block)) contrasts(data[[block]]) <- contr.sum(nlevels(data[[block]]))
  fit <- lm(reformulate(c(names, products, squares, if (nzchar(block)) block), "y"), data)
  terms <- c(names, products, squares)
  shown <- c(names, products, paste0(names, "^2"))
  rows_of_terms(table, fit, setNames(as.list(c("1", shown)), c("(Intercept)", terms)))
  parts <- drop1(fit, terms)
  for (k in seq_along(terms)) say(table, "sum of squares", shown[k], parts[terms[k], "Sum of Sq"])
  say(table, "sum of squares", "residual", deviance(fit))
  if (nzchar(block)) say(table, "sum of squares", paste("block", block), anova(lm(reformulate(block, "y"), data))[1, 2])
  say(table, "R2", "", summary(fit)$r.squared)
  say(table, "R2", "adjusted", summary(fit)$adj.r.squared)
  press <- sum((residuals(fit) / (1 - hatvalues(fit)))^2)
  say(table, "R2", "predicted", 1 - press / sum((data$y - mean(data$y))^2))
  lack_of_fit(table, fit, data, c(names, if (nzchar(block)) block))
  for (k in seq_len(nrow(data))) {
    say(table, "leverage", paste("run", k), hatvalues(fit)[k])
    say(table, "R-student", paste("run", k), rstudent(fit)[k])
    say(table, "Cook's D", paste("run", k), cooks.distance(fit)[k])
  }
  second <- diag(coef(fit)[squares], length(names))
  for (pair in products) {
    at <- match(strsplit(pair, ":")[[1]], names)
    second[at[1], at[2]] <- second[at[2], at[1]] <- coef(fit)[pair] / 2
  }
  point <- -solve(second, coef(fit)[names]) / 2
  for (k in seq_along(names)) say(table, "stationary point", names[k], point[k])
  values <- eigen(second, symmetric = TRUE)$values
  for (k in seq_along(values)) say(table, "eigenvalue", as.character(k), values[k])
  if (!nzchar(block)) {
    new <- as.data.frame(as.list(setNames(rep(0.5, length(names)), names)))
    for (kind in c("confidence", "prediction")) {
      found <- predict(fit, new, interval = kind)
      say(table, kind, "low", found[1, "lwr"])
      say(table, kind, "high", found[1, "upr"])
    }
  }
}

for (k in seq_len(nrow(tables))) {
  spec <- tables[k, ]
  data <- read.csv(spec$file, check.names = FALSE)
  data <- coded(data[setdiff(names(data), strsplit(spec$ignore, ";")[[1]])], spec$factors)
  names(data)[ncol(data)] <- "y"
  block <- spec$block
  factors <- setdiff(names(data), c("y", block))
  if (nzchar(block)) data[[block]] <- factor(data[[block]])
  (if (spec$command == "pb") screening else surface)(spec, data, factors, block)
}
write.csv(do.call(rbind, answers), paths[2], row.names = FALSE)
